#include "coordinator/service/client_service.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <memory>
#include <optional>
#include <vector>

#include "common/rpc/channel.h"
#include "common/rpc/convert.h"
#include "coordinator/service/limits/in_flight_limit.h"
#include "coordinator/service/page_tokens.h"
#include "coordinator/service/service_status.h"
#include "coordinator/service/streams/sending_call.h"
#include "coordinator/service/streams/upload_call.h"

namespace lightmill {
namespace {

// Calls at once. Beyond, the slowest peer of the kind makes room.
constexpr size_t kMaxAnswers = 768, kMaxWatches = 4096, kMaxUploads = 256;
/// Of the images and ledgers that are being sent.
constexpr uint64_t kAnswerBytes = uint64_t{96} << 20;
/// Threads that resolve images and read ledgers, and that make messages and write files.
constexpr size_t kOpeningThreads = 8, kStreamingThreads = 8;
constexpr int kMaxAskedBlobs = 100000;
constexpr int kMaxVerifications = 4;
constexpr int kTilesPerMessage = 400, kLinesPerMessage = 200;  // some 64 KiB
constexpr uint64_t kTileBytes = 256, kLogLineBytes = 512;
constexpr size_t kMaxListed = 1000;      // jobs or workers of a page
constexpr size_t kJobsPerLock = 100;     // others get at the farm in between
constexpr size_t kPageBytes = 8u << 20;  // a page that is longer ends early: half of the largest message
constexpr std::string_view kJobsPageToken = "job-";       // and how many jobs came before
constexpr std::string_view kWorkersPageToken = "after-";  // and the last worker before

/// How many jobs the pages before had.
size_t listed_before(const std::string& token) {
  return static_cast<size_t>(number_of_token(token, kJobsPageToken, 1, INT64_MAX).value_or(0));
}

/// The last worker of the pages before. Throws Error(kUsage) for a token that no answer gave.
WorkerId last_worker_before(const std::string& token) {
  if (token.empty()) return {};
  if (token.size() > kWorkersPageToken.size() && token.starts_with(kWorkersPageToken))
    return WorkerId{token.substr(kWorkersPageToken.size())};
  throw Error(ErrorKind::kUsage, "page_token is none that an answer to ListWorkers gave; begin without one");
}

/// How much a request for a page asks for; 0: it knows of no pages.
template <class Request>
size_t page_size(const Request& request) {
  if (request.page_size() < 0) throw Error(ErrorKind::kUsage, "page_size must not be negative");
  if (request.page_size() > 0) return std::min(static_cast<size_t>(request.page_size()), kMaxListed);
  return request.page_token().empty() ? 0 : kMaxListed;
}

/// Sends rows, so many to a message.
template <class Response, class Row, class Add>
MessageSource<Response> rows_of(std::vector<Row> rows, std::shared_ptr<const void> share, int per_message,
                                Add add) {
  return [rows = std::move(rows), share = std::move(share), per_message, add,
          next = size_t{0}](Response* message) mutable {
    message->Clear();
    for (int i = 0; i < per_message && next < rows.size(); ++i) add(rows[next++], message);
    return message->ByteSizeLong() > 0;
  };
}

}  // namespace

ClientService::ClientService(Farm& farm, BlobStore& blobs, const TileLog& tile_log, StallWatch& stalls,
                             const Quotas& quotas, SubmissionGate& gate,
                             std::shared_ptr<SubmitLimit> submissions, Caller caller)
    : farm_(farm),
      blobs_(blobs),
      tile_log_(tile_log),
      stalls_(stalls),
      quotas_(quotas),
      gate_(gate),
      submissions_(std::move(submissions)),
      caller_(std::move(caller)),
      answers_(stalls, kMaxAnswers),
      memory_(kAnswerBytes, [this] { answers_.cut_slowest(StallWatch::kSlowBytesPerSecond); }),
      images_(farm, memory_),
      watches_(
          [&farm](const std::string& id) {
            v1::WatchJobResponse message;
            *message.mutable_job() = to_proto(farm.job(JobId{id}));
            return message;
          },
          stalls, kMaxWatches),
      uploads_(stalls, kMaxUploads),
      opening_(kOpeningThreads),
      streaming_(kStreamingThreads) {}

template <class Response>
grpc::ServerWriteReactor<Response>* ClientService::send(grpc::CallbackServerContext* context,
                                                        std::function<MessageSource<Response>()> open) {
  return new SendingCall<Response>(*context, stalls_, answers_, {opening_, streaming_},
                                   "images, ledgers and logs are being sent at once", std::move(open));
}

Image ClientService::read_reference(const v1::Reference& reference, const RenderSettings& settings) const {
  const PixelRect& crop = settings.grid.crop;
  // The size is checked against the job's before anything of that size is allocated.
  if (reference.width() != crop.width() || reference.height() != crop.height()) {
    throw Error(ErrorKind::kUsage, "the reference image is " + std::to_string(reference.width()) + "x" +
                                       std::to_string(reference.height()) + ", the job renders " +
                                       std::to_string(crop.width()) + "x" + std::to_string(crop.height()));
  }
  const std::string path = blobs_.path(reference.digest());
  Image image(reference.width(), reference.height());
  const size_t bytes = image.data.size() * sizeof(float);
  if (blobs_.size(reference.digest()) != bytes) {
    throw Error(ErrorKind::kUsage, "the reference blob is not width*height*3 floats");
  }
  std::ifstream in(path, std::ios::binary);
  in.read(reinterpret_cast<char*>(image.data.data()), static_cast<std::streamsize>(bytes));
  if (!in) throw StoreError(path + ": cannot be read");
  return image;
}

grpc::Status ClientService::SubmitJob(grpc::ServerContext* context, const v1::SubmitJobRequest* request,
                                      v1::SubmitJobResponse* response) {
  return guarded([&] {
    const std::string refusal = submissions_ ? submissions_->refusal("") : "";
    if (!refusal.empty()) throw LimitReached(refusal);
    JobRequest job;
    job.name = request->name();
    const SubmissionGate::Pass pass(gate_, request->ByteSizeLong());
    job.bundle = read_manifest(request->bundle_json());
    job.settings = settings_from_json(request->settings_json());
    job.priority = request->priority();
    job.pool = request->pool();
    job.submitter = caller_ ? caller_(*context) : request->submitter();
    job.max_workers = request->max_workers();
    job.deadline = request->deadline();
    for (const std::string& id : request->after()) job.after.push_back(JobId{id});
    check_quotas(quotas_, job);
    require_files(blobs_, job.bundle);
    if (request->has_reference()) job.reference = read_reference(request->reference(), job.settings);
    response->set_job_id(farm_.submit(job).value);
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::GetJob(grpc::ServerContext*, const v1::GetJobRequest* request,
                                   v1::GetJobResponse* response) {
  return guarded([&] {
    const JobId id{request->job_id()};
    *response->mutable_job() = to_proto(farm_.job(id));
    try {
      if (const auto pilot = farm_.pilot(id)) response->set_pilot_json(pilot_to_json(*pilot));
    } catch (const StoreError&) {  // the status says what is wrong with the store
    }
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::ListJobs(grpc::ServerContext*, const v1::ListJobsRequest* request,
                                     v1::ListJobsResponse* response) {
  return guarded([&] {
    const size_t page = page_size(*request);
    const size_t total = farm_.job_count();
    const size_t most = page > 0 ? page : kMaxListed;
    size_t next = total - std::min(total, kMaxListed);
    if (page > 0) next = listed_before(request->page_token());
    size_t bytes = 0, rows = 0;
    while (next < total && rows < most && bytes < kPageBytes) {
      const size_t count = std::min({total - next, most - rows, kJobsPerLock});
      const std::vector<JobStatus> part = farm_.jobs(next, count, !request->without_frames());
      for (const JobStatus& job : part) {
        v1::JobStatus& row = *response->add_jobs();
        row = to_proto(job);
        bytes += row.ByteSizeLong();
      }
      next += count;
      rows += part.size();
    }
    if (page > 0 && next < total)
      response->set_next_page_token(std::string(kJobsPageToken) + std::to_string(next));
    response->set_total_size(static_cast<int32_t>(total));
    return grpc::Status::OK;
  });
}

grpc::ServerWriteReactor<v1::ListTilesResponse>* ClientService::ListTiles(
    grpc::CallbackServerContext* context, const v1::ListTilesRequest* request) {
  return send<v1::ListTilesResponse>(context, [this, job = JobId{request->job_id()}] {
    const JobStatus status = farm_.job(job);
    auto share = memory_.take(kTileBytes * static_cast<uint64_t>(status.tiles_committed +
                                                                 status.tiles_leased + status.tiles_pending));
    return rows_of<v1::ListTilesResponse>(farm_.tiles(job), std::move(share), kTilesPerMessage,
                                          [](const TileStatus& tile, v1::ListTilesResponse* message) {
                                            *message->add_tiles() = to_proto(tile);
                                          });
  });
}

grpc::ServerWriteReactor<v1::GetLogsResponse>* ClientService::GetLogs(grpc::CallbackServerContext* context,
                                                                      const v1::GetLogsRequest* request) {
  return send<v1::GetLogsResponse>(context, [this, asked = *request] {
    const int64_t most = asked.max_lines();
    if (most < 1 || most > static_cast<int64_t>(TileLog::kMaxLines))
      throw Error(ErrorKind::kUsage, "max_lines must be 1 to 20000");
    const JobId job = farm_.job(JobId{asked.job_id()}).id;
    std::optional<TileId> tile;
    if (asked.has_tile_id()) tile = TileId{asked.tile_id()};
    auto share = memory_.take(static_cast<uint64_t>(most) * kLogLineBytes);
    return rows_of<v1::GetLogsResponse>(tile_log_.of(job, tile, static_cast<size_t>(most)), std::move(share),
                                        kLinesPerMessage,
                                        [](const TileLog::Line& line, v1::GetLogsResponse* message) {
                                          v1::LogLine* const out = message->add_lines();
                                          out->set_time(line.time);
                                          out->set_tile_id(line.about.tile);
                                          out->set_attempt(line.about.attempt);
                                          out->set_worker_id(line.about.worker);
                                          out->set_text(one_line(line.text));
                                        });
  });
}

grpc::Status ClientService::ListWorkers(grpc::ServerContext*, const v1::ListWorkersRequest* request,
                                        v1::ListWorkersResponse* response) {
  return guarded([&] {
    const size_t page = page_size(*request);
    WorkerPage part{{}, last_worker_before(request->page_token()), 0};
    size_t bytes = 0;
    do {  // who knows of no pages gets what goes into a message
      part = farm_.workers(part.last, page > 0 ? page : kMaxListed);
      for (const WorkerStatus& worker : part.workers) {
        v1::WorkerStatus& row = *response->add_workers();
        row = to_proto(worker);
        bytes += row.ByteSizeLong();
      }
    } while (page == 0 && !part.last.value.empty() && bytes < kPageBytes);
    if (page > 0 && !part.last.value.empty())
      response->set_next_page_token(std::string(kWorkersPageToken) + part.last.value);
    response->set_total_size(static_cast<int32_t>(part.total));
    return grpc::Status::OK;
  });
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* ClientService::WatchJob(grpc::CallbackServerContext* context,
                                                                        const v1::WatchJobRequest* request) {
  return watches_.watch(*context, request->job_id());
}

grpc::Status ClientService::PauseJob(grpc::ServerContext*, const v1::PauseJobRequest* request,
                                     v1::PauseJobResponse* response) {
  return guarded([&] {
    farm_.pause(JobId{request->job_id()});
    *response->mutable_job() = to_proto(farm_.job(JobId{request->job_id()}));
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::ResumeJob(grpc::ServerContext*, const v1::ResumeJobRequest* request,
                                      v1::ResumeJobResponse* response) {
  return guarded([&] {
    farm_.resume(JobId{request->job_id()});
    *response->mutable_job() = to_proto(farm_.job(JobId{request->job_id()}));
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::CancelJob(grpc::ServerContext*, const v1::CancelJobRequest* request,
                                      v1::CancelJobResponse* response) {
  return guarded([&] {
    farm_.cancel(JobId{request->job_id()});
    *response->mutable_job() = to_proto(farm_.job(JobId{request->job_id()}));
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::RetryJob(grpc::ServerContext*, const v1::RetryJobRequest* request,
                                     v1::RetryJobResponse* response) {
  return guarded([&] {
    farm_.retry(JobId{request->job_id()});
    *response->mutable_job() = to_proto(farm_.job(JobId{request->job_id()}));
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::SetJobPriority(grpc::ServerContext*, const v1::SetJobPriorityRequest* request,
                                           v1::SetJobPriorityResponse* response) {
  return guarded([&] {
    farm_.set_priority(JobId{request->job_id()}, request->priority());
    *response->mutable_job() = to_proto(farm_.job(JobId{request->job_id()}));
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::ExtendJob(grpc::ServerContext*, const v1::ExtendJobRequest* request,
                                      v1::ExtendJobResponse* response) {
  return guarded([&] {
    std::optional<int64_t> spp;
    std::optional<double> time_s, target_error;
    if (request->has_spp()) spp = request->spp();
    if (request->has_time_seconds()) time_s = request->time_seconds();
    if (request->has_target_error()) target_error = request->target_error();
    farm_.extend(JobId{request->job_id()}, spp, time_s, target_error);
    *response->mutable_job() = to_proto(farm_.job(JobId{request->job_id()}));
    return grpc::Status::OK;
  });
}

grpc::ServerWriteReactor<v1::FetchImageResponse>* ClientService::FetchImage(
    grpc::CallbackServerContext* context, const v1::FetchImageRequest* request) {
  return send<v1::FetchImageResponse>(context,
                                      [this, asked = *request] { return chunks_of(images_.get(asked)); });
}

grpc::Status ClientService::GetCurve(grpc::ServerContext*, const v1::GetCurveRequest* request,
                                     v1::GetCurveResponse* response) {
  return guarded([&] {
    *response->mutable_curve() = to_proto(farm_.curve(JobId{request->job_id()}));
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::FindMissingBlobs(grpc::ServerContext*, const v1::FindMissingBlobsRequest* request,
                                             v1::FindMissingBlobsResponse* response) {
  return guarded([&] {
    if (request->digests_size() > kMaxAskedBlobs)
      throw Error(ErrorKind::kUsage, "more than 100000 blobs at once");
    // Beyond the limit the answer is what is known already.
    const Slot slot(verifications_, kMaxVerifications);
    const std::vector<std::string> digests(request->digests().begin(), request->digests().end());
    for (const std::string& digest : blobs_.missing(digests, slot.granted() ? BlobStore::kVerifyBytes : 0))
      response->add_digests(digest);
    return grpc::Status::OK;
  });
}

grpc::ServerReadReactor<v1::UploadBlobsRequest>* ClientService::UploadBlobs(
    grpc::CallbackServerContext* context, v1::UploadBlobsResponse* response) {
  return new UploadCall(*context, stalls_, uploads_, streaming_, blobs_, quotas_, response);
}

}  // namespace lightmill
