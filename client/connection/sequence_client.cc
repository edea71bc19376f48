#include "client/connection/sequence_client.h"

#include <utility>

#include "client/connection/answers.h"
#include "client/connection/farm_connection.h"
#include "common/rpc/sequence_messages.h"
#include "common/rpc/status.h"

namespace lightmill::client {
namespace {

using SequenceStub = v1::SequenceService::Stub;

/// Of a call that changes thousands of frames.
constexpr double kChangeSeconds = 600;
/// Of the frames of one call, well below what a message may have.
constexpr size_t kBytesPerCall = size_t{8} << 20;

/// Calls that name a sequence and answer with its status.
template <class Request, class Response>
SequenceStatus change_sequence(FarmConnection& farm,
                               grpc::Status (SequenceStub::*method)(grpc::ClientContext*, const Request&,
                                                                    Response*),
                               const SequenceId& id) {
  Request request;
  request.set_sequence_id(id.value);
  return from_proto(farm.call(method, request, kChangeSeconds).sequence());
}

/// Frames from `*next` on, as many as go into a call; settings that are the request's are not repeated.
template <class Request>
void add_some(const std::vector<FrameRequest>& frames, const std::string& settings, size_t* next,
              Request* request) {
  size_t bytes = 0;
  for (size_t count = 0; *next < frames.size() && count < kMaxFramesOfCall && bytes < kBytesPerCall;
       ++count, ++*next) {
    const FrameRequest& frame = frames[*next];
    v1::Frame& message = *request->add_frames();
    message.set_number(frame.number);
    message.set_bundle_json(bundle_to_json(frame.bundle));
    std::string own = settings_to_json(frame.settings);
    if (own != settings) message.set_settings_json(std::move(own));
    bytes += message.ByteSizeLong();
  }
}

}  // namespace

SequenceClient::SequenceClient(const ConnectionOptions& connection)
    : farm_(std::make_unique<FarmConnection>(connection)) {}
SequenceClient::~SequenceClient() = default;

SequenceId SequenceClient::submit(const SequenceRequest& request, const std::vector<FrameRequest>& frames,
                                  const std::map<std::string, std::string>& blob_paths,
                                  const UploadProgress& uploading) {
  std::vector<Bundle> bundles;
  for (const FrameRequest& frame : frames) bundles.push_back(frame.bundle);
  upload_files(*farm_, bundles, blob_paths, uploading);
  const std::string settings = frames.empty() ? "" : settings_to_json(frames.front().settings);
  v1::SubmitSequenceRequest message;
  message.set_name(one_line(request.name));
  message.set_settings_json(settings);
  message.set_priority(request.priority);
  message.set_pool(one_line(request.pool));
  message.set_submitter(one_line(request.submitter));
  message.set_max_workers(request.max_workers);
  message.set_deadline(request.deadline);
  for (const JobId& id : request.after) message.add_after(id.value);
  message.set_order(to_proto(request.order));
  message.set_fps(request.fps);
  message.set_budget_seconds(request.budget_seconds);
  size_t next = 0;
  add_some(frames, settings, &next, &message);
  const SequenceId id{farm_->call(&SequenceStub::SubmitSequence, message, kTransferSeconds).sequence_id()};
  while (next < frames.size()) {
    v1::AddFramesRequest more;
    more.set_sequence_id(id.value);
    more.set_settings_json(settings);
    add_some(frames, settings, &next, &more);
    farm_->call(&SequenceStub::AddFrames, more, kTransferSeconds);
  }
  return id;
}

SequenceStatus SequenceClient::sequence(const SequenceId& id) {
  return change_sequence(*farm_, &SequenceStub::GetSequence, id);
}
SequenceStatus SequenceClient::pause(const SequenceId& id) {
  return change_sequence(*farm_, &SequenceStub::PauseSequence, id);
}
SequenceStatus SequenceClient::resume(const SequenceId& id) {
  return change_sequence(*farm_, &SequenceStub::ResumeSequence, id);
}
SequenceStatus SequenceClient::cancel(const SequenceId& id) {
  return change_sequence(*farm_, &SequenceStub::CancelSequence, id);
}
SequenceStatus SequenceClient::retry(const SequenceId& id) {
  return change_sequence(*farm_, &SequenceStub::RetrySequence, id);
}

SequenceStatus SequenceClient::extend(const SequenceId& id, std::optional<int64_t> spp,
                                      std::optional<double> time_s, std::optional<double> target_error) {
  v1::ExtendSequenceRequest request;
  request.set_sequence_id(id.value);
  if (spp) request.set_spp(*spp);
  if (time_s) request.set_time_seconds(*time_s);
  if (target_error) request.set_target_error(*target_error);
  return from_proto(farm_->call(&SequenceStub::ExtendSequence, request, kChangeSeconds).sequence());
}

SequenceStatus SequenceClient::set_priority(const SequenceId& id, int priority) {
  v1::SetSequencePriorityRequest request;
  request.set_sequence_id(id.value);
  request.set_priority(priority);
  return from_proto(farm_->call(&SequenceStub::SetSequencePriority, request).sequence());
}

std::vector<SequenceStatus> SequenceClient::sequences() {
  std::vector<SequenceStatus> list;
  turn_pages(*farm_, &SequenceStub::ListSequences, v1::ListSequencesRequest(),
             [&](const v1::ListSequencesResponse& page) {
               for (const v1::SequenceStatus& sequence : page.sequences())
                 list.push_back(from_proto(sequence));
               return page.sequences().empty() ? 0 : list.size();
             });
  return list;
}

std::vector<FrameStatus> SequenceClient::frames(const SequenceId& id, uint64_t since) {
  std::vector<FrameStatus> list;
  v1::ListFramesRequest request;
  request.set_sequence_id(id.value);
  request.set_since_version(since);
  turn_pages(*farm_, &SequenceStub::ListFrames, request, [&](const v1::ListFramesResponse& page) {
    for (const v1::FrameStatus& frame : page.frames()) list.push_back(from_proto(frame));
    return page.frames().empty() ? 0 : list.size();
  });
  return list;
}

SequenceStatus SequenceClient::watch(const SequenceId& id,
                                     const std::function<void(const SequenceStatus&)>& observe,
                                     const std::function<void(const std::string&)>& lost) {
  v1::WatchSequenceRequest request;
  request.set_sequence_id(id.value);
  return watch_stream<SequenceStatus, v1::WatchSequenceResponse>(
      *farm_, "sequence", id.value,
      [&](grpc::ClientContext* context) { return farm_->sequences()->WatchSequence(context, request); },
      [](const v1::WatchSequenceResponse& message) { return from_proto(message.sequence()); }, observe, lost);
}

}  // namespace lightmill::client
