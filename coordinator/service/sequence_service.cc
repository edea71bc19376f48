#include "coordinator/service/sequence_service.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "common/rpc/sequence_messages.h"
#include "coordinator/service/page_tokens.h"
#include "coordinator/service/service_status.h"

namespace lightmill {
namespace {

constexpr size_t kMaxWatchedSequences = 1024;
constexpr size_t kMaxListedSequences = 100, kMaxListedFrames = 1000;
constexpr size_t kFramesPerLock = 200;  // others get at the farm in between

template <class T>
std::optional<T> given(bool has, T value) {
  return has ? std::optional(value) : std::nullopt;
}

}  // namespace

SequenceService::SequenceService(Farm& farm, BlobStore& blobs, StallWatch& stalls, const Quotas& quotas,
                                 SubmissionGate& gate, std::shared_ptr<SubmitLimit> submissions,
                                 Caller caller)
    : farm_(farm),
      blobs_(blobs),
      quotas_(quotas),
      gate_(gate),
      submissions_(std::move(submissions)),
      caller_(std::move(caller)),
      watches_(
          [&farm](const std::string& id) {
            v1::WatchSequenceResponse message;
            *message.mutable_sequence() = to_proto(farm.sequence(SequenceId{id}));
            return message;
          },
          stalls, kMaxWatchedSequences) {}

template <class Request>
std::vector<FrameRequest> SequenceService::read_frames(const Request& request) {
  if (request.frames_size() > static_cast<int>(kMaxFramesOfCall)) {
    throw Error(ErrorKind::kUsage, "at most " + std::to_string(kMaxFramesOfCall) +
                                       " frames come in one call; add the others by further calls");
  }
  std::vector<FrameRequest> frames;
  std::set<std::string> known_files;
  std::optional<RenderSettings> common;
  for (const v1::Frame& frame : request.frames()) {
    FrameRequest read;
    read.number = frame.number();
    read.bundle = read_manifest(frame.bundle_json());
    if (!frame.settings_json().empty()) {
      read.settings = settings_from_json(frame.settings_json());
    } else {
      if (!common) common = settings_from_json(request.settings_json());
      read.settings = *common;
    }
    JobRequest job;
    job.bundle = read.bundle;
    job.settings = read.settings;
    check_quotas(quotas_, job);
    require_files(blobs_, read.bundle, &known_files);
    frames.push_back(std::move(read));
  }
  return frames;
}

grpc::Status SequenceService::SubmitSequence(grpc::ServerContext* context,
                                             const v1::SubmitSequenceRequest* request,
                                             v1::SubmitSequenceResponse* response) {
  return guarded([&] {
    const std::string refusal = submissions_ ? submissions_->refusal("") : "";
    if (!refusal.empty()) throw LimitReached(refusal);
    const SubmissionGate::Pass pass(gate_, request->ByteSizeLong());
    SequenceRequest sequence;
    sequence.name = request->name();
    sequence.priority = request->priority();
    sequence.pool = request->pool();
    sequence.submitter = caller_ ? caller_(*context) : request->submitter();
    sequence.max_workers = request->max_workers();
    sequence.deadline = request->deadline();
    for (const std::string& id : request->after()) sequence.after.push_back(JobId{id});
    sequence.order = from_proto(request->order());
    sequence.fps = request->fps();
    sequence.budget_seconds = request->budget_seconds();
    const std::vector<FrameRequest> frames = read_frames(*request);
    if (sequence.budget_seconds > 0 && !frames.empty()) {
      sequence.most_spp = 1;
      for (const FrameRequest& frame : frames)
        sequence.most_spp = std::max(sequence.most_spp, frame.settings.spp);
    }
    response->set_sequence_id(farm_.submit(sequence, frames).value);
    return grpc::Status::OK;
  });
}

grpc::Status SequenceService::AddFrames(grpc::ServerContext*, const v1::AddFramesRequest* request,
                                        v1::AddFramesResponse* response) {
  return guarded([&] {
    const SubmissionGate::Pass pass(gate_, request->ByteSizeLong());
    const SequenceId id{request->sequence_id()};
    farm_.sequence(id);  // an unknown one is that before it is anything else
    farm_.add_frames(id, read_frames(*request));
    *response->mutable_sequence() = to_proto(farm_.sequence(id));
    return grpc::Status::OK;
  });
}

grpc::Status SequenceService::GetSequence(grpc::ServerContext*, const v1::GetSequenceRequest* request,
                                          v1::GetSequenceResponse* response) {
  return guarded([&] {
    *response->mutable_sequence() = to_proto(farm_.sequence(SequenceId{request->sequence_id()}));
    return grpc::Status::OK;
  });
}

grpc::Status SequenceService::ListSequences(grpc::ServerContext*, const v1::ListSequencesRequest* request,
                                            v1::ListSequencesResponse* response) {
  return guarded([&] {
    const size_t most = page_size(*request, kMaxListedSequences);
    const size_t begin = number_of_token(request->page_token(), "sequence-", 1, INT32_MAX).value_or(0);
    const std::vector<SequenceStatus> found = farm_.sequences(begin, most);
    for (const SequenceStatus& sequence : found) *response->add_sequences() = to_proto(sequence);
    const size_t total = farm_.sequence_count();
    if (begin + found.size() < total && !found.empty())
      response->set_next_page_token("sequence-" + std::to_string(begin + found.size()));
    response->set_total_size(static_cast<int32_t>(total));
    return grpc::Status::OK;
  });
}

grpc::Status SequenceService::ListFrames(grpc::ServerContext*, const v1::ListFramesRequest* request,
                                         v1::ListFramesResponse* response) {
  return guarded([&] {
    const size_t most = page_size(*request, kMaxListedFrames);
    const SequenceId id{request->sequence_id()};
    FramePage part;
    if (const auto after = number_of_token(request->page_token(), "frame-", INT32_MIN, INT32_MAX))
      part.last = static_cast<int>(*after);
    do {
      const size_t left = most - static_cast<size_t>(response->frames_size());
      part = farm_.frames(id, part.last, std::min(left, kFramesPerLock), request->since_version());
      for (const FrameStatus& frame : part.frames) *response->add_frames() = to_proto(frame);
    } while (part.last && static_cast<size_t>(response->frames_size()) < most);
    if (part.last) response->set_next_page_token("frame-" + std::to_string(*part.last));
    response->set_total_size(static_cast<int32_t>(part.total));
    return grpc::Status::OK;
  });
}

grpc::ServerWriteReactor<v1::WatchSequenceResponse>* SequenceService::WatchSequence(
    grpc::CallbackServerContext* context, const v1::WatchSequenceRequest* request) {
  return watches_.watch(*context, request->sequence_id());
}

template <class Request, class Response, class Action>
grpc::Status SequenceService::change(const Request& request, Response* response, Action action) {
  return guarded([&] {
    const SequenceId id{request.sequence_id()};
    action(id);
    *response->mutable_sequence() = to_proto(farm_.sequence(id));
    return grpc::Status::OK;
  });
}

grpc::Status SequenceService::PauseSequence(grpc::ServerContext*, const v1::PauseSequenceRequest* request,
                                            v1::PauseSequenceResponse* response) {
  return change(*request, response, [this](const SequenceId& id) { farm_.pause(id); });
}
grpc::Status SequenceService::ResumeSequence(grpc::ServerContext*, const v1::ResumeSequenceRequest* request,
                                             v1::ResumeSequenceResponse* response) {
  return change(*request, response, [this](const SequenceId& id) { farm_.resume(id); });
}
grpc::Status SequenceService::CancelSequence(grpc::ServerContext*, const v1::CancelSequenceRequest* request,
                                             v1::CancelSequenceResponse* response) {
  return change(*request, response, [this](const SequenceId& id) { farm_.cancel(id); });
}
grpc::Status SequenceService::RetrySequence(grpc::ServerContext*, const v1::RetrySequenceRequest* request,
                                            v1::RetrySequenceResponse* response) {
  return change(*request, response, [this](const SequenceId& id) { farm_.retry(id); });
}
grpc::Status SequenceService::ExtendSequence(grpc::ServerContext*, const v1::ExtendSequenceRequest* request,
                                             v1::ExtendSequenceResponse* response) {
  return change(*request, response, [&](const SequenceId& id) {
    farm_.extend(id, given(request->has_spp(), request->spp()),
                 given(request->has_time_seconds(), request->time_seconds()),
                 given(request->has_target_error(), request->target_error()));
  });
}
grpc::Status SequenceService::SetSequencePriority(grpc::ServerContext*,
                                                  const v1::SetSequencePriorityRequest* request,
                                                  v1::SetSequencePriorityResponse* response) {
  return change(*request, response,
                [&](const SequenceId& id) { farm_.set_priority(id, request->priority()); });
}

}  // namespace lightmill
