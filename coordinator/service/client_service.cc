#include "coordinator/service/client_service.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstring>
#include <fstream>
#include <optional>
#include <thread>

#include "common/rpc/channel.h"
#include "common/rpc/convert.h"
#include "coordinator/service/in_flight_limit.h"
#include "coordinator/service/service_status.h"

namespace lightmill {
namespace {

// Streams have a thread each, of the 512 that all calls share (common/rpc/channel.cc): together they must
// leave some to others.
constexpr int kMaxFetches = 8;  // an image is resolved in memory for each
constexpr int kMaxWatches = 256, kMaxUploads = 32, kMaxListings = 32;
constexpr int kMaxAskedBlobs = 100000;
constexpr int kMaxVerifications = 4;
constexpr int kTilesPerMessage = 1000;
constexpr int kLinesPerMessage = 1000;
constexpr size_t kMaxListed = 1000;      // jobs or workers of a page
constexpr size_t kJobsPerLock = 100;     // others get at the farm in between
constexpr size_t kPageBytes = 8u << 20;  // a page that is longer ends early: half of the largest message
constexpr std::string_view kJobsPageToken = "job-";       // and how many jobs came before
constexpr std::string_view kWorkersPageToken = "after-";  // and the last worker before
constexpr size_t kMaxUploadChunk = size_t{4} << 20;
constexpr double kWatchBeatSeconds = 1;
constexpr std::chrono::milliseconds kWatchSpacing(200);

/// A manifest larger than this waits until few others are unpacked: that takes several times its bytes.
constexpr size_t kLargeSubmission = 64 << 10;
constexpr std::chrono::seconds kSubmissionPatience(10);

/// A name as it is kept and shown; one that is too long stays, to be refused.
std::string harmless(const std::string& name) { return name.size() > kMaxNameBytes ? name : one_line(name); }

/// How many jobs the pages before had. Throws Error(kUsage) for a token that no answer gave.
size_t listed_before(const std::string& token) {
  if (token.empty()) return 0;
  uint32_t count = 0;
  const char* const end = token.data() + token.size();
  if (token.starts_with(kJobsPageToken)) {
    const auto [stop, error] = std::from_chars(token.data() + kJobsPageToken.size(), end, count);
    if (error == std::errc() && stop == end && count > 0) return count;
  }
  throw Error(ErrorKind::kUsage, "page_token is none that an answer to ListJobs gave; begin without one");
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

grpc::Status too_many(const char* what) {
  return {grpc::StatusCode::RESOURCE_EXHAUSTED, std::string("too many ") + what + " at once; try again"};
}

}  // namespace

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
    job.name = harmless(request->name());
    std::optional<Turn> turn;
    if (request->ByteSizeLong() > kLargeSubmission) {
      turn.emplace(large_submissions_, kSubmissionPatience);
      if (!turn->granted())
        throw LimitReached("too many scenes of thousands of files come in at once; try again");
    }
    try {
      job.bundle = bundle_from_json(request->bundle_json());
    } catch (const Error& e) {
      throw Error(ErrorKind::kUsage, e.what());  // it came from outside: a wrong request, not a failed disk
    }
    job.settings = settings_from_json(request->settings_json());
    job.priority = request->priority();
    job.pool = harmless(request->pool());
    job.submitter = caller_ ? caller_(*context) : harmless(request->submitter());
    job.max_workers = request->max_workers();
    for (const std::string& id : request->after()) job.after.push_back(JobId{id});
    check_quotas(quotas_, job);
    for (const BundleEntry& entry : job.bundle.entries) {
      if (blobs_.contains(entry.digest)) continue;
      throw Error(ErrorKind::kFailed, "file " + entry.name + " of the bundle was not uploaded");
    }
    for (const BundleEntry& entry : job.bundle.entries) {
      if (blobs_.size(entry.digest) == entry.size) continue;
      if (!blobs_.verify(entry.digest)) {
        throw Error(ErrorKind::kFailed,
                    "file " + entry.name + " of the bundle was damaged on the coordinator; submit it again");
      }
      throw Error(ErrorKind::kUsage, "file " + entry.name + " of the bundle has another size than it says");
    }
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
    size_t next = page > 0 ? listed_before(request->page_token()) : total - std::min(total, kMaxListed);
    const size_t end = std::min(total, next) + (page > 0 ? page : kMaxListed);
    size_t bytes = 0;
    while (next < end && bytes < kPageBytes) {
      const std::vector<JobStatus> part = farm_.jobs(next, std::min(end - next, kJobsPerLock));
      if (part.empty()) break;
      for (const JobStatus& job : part) {
        v1::JobStatus& row = *response->add_jobs();
        row = to_proto(job);
        bytes += row.ByteSizeLong();
      }
      next += part.size();
    }
    if (page > 0 && next < total)
      response->set_next_page_token(std::string(kJobsPageToken) + std::to_string(next));
    response->set_total_size(static_cast<int32_t>(total));
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::ListTiles(grpc::ServerContext* context, const v1::ListTilesRequest* request,
                                      grpc::ServerWriter<v1::ListTilesResponse>* writer) {
  return guarded([&]() -> grpc::Status {
    const Slot slot(listings_, kMaxListings);
    if (!slot.granted()) return too_many("ledgers and logs are being listed");
    StallWatch::Call call(stalls_, *context);
    v1::ListTilesResponse message;
    for (const TileStatus& tile : farm_.tiles(JobId{request->job_id()})) {
      *message.add_tiles() = to_proto(tile);
      if (message.tiles_size() < kTilesPerMessage) continue;
      if (!call.write(*writer, message)) return grpc::Status::CANCELLED;
      message.clear_tiles();
    }
    if (message.tiles_size() > 0) call.write(*writer, message);
    return grpc::Status::OK;
  });
}

grpc::Status ClientService::GetLogs(grpc::ServerContext* context, const v1::GetLogsRequest* request,
                                    grpc::ServerWriter<v1::GetLogsResponse>* writer) {
  return guarded([&]() -> grpc::Status {
    const Slot slot(listings_, kMaxListings);
    if (!slot.granted()) return too_many("ledgers and logs are being listed");
    StallWatch::Call call(stalls_, *context);
    const int64_t most = request->max_lines();
    if (most < 1 || most > static_cast<int64_t>(TileLog::kMaxLines))
      throw Error(ErrorKind::kUsage, "max_lines must be 1 to 20000");
    const JobId job = farm_.job(JobId{request->job_id()}).id;
    std::optional<TileId> tile;
    if (request->has_tile_id()) tile = TileId{request->tile_id()};
    v1::GetLogsResponse message;
    for (const TileLog::Line& line : tile_log_.of(job, tile, static_cast<size_t>(most))) {
      v1::LogLine* const out = message.add_lines();
      out->set_time(line.time);
      out->set_tile_id(line.about.tile);
      out->set_attempt(line.about.attempt);
      out->set_worker_id(line.about.worker);
      out->set_text(one_line(line.text));
      if (message.lines_size() < kLinesPerMessage) continue;
      if (!call.write(*writer, message)) return grpc::Status::CANCELLED;
      message.clear_lines();
    }
    if (message.lines_size() > 0) call.write(*writer, message);
    return grpc::Status::OK;
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

grpc::Status ClientService::WatchJob(grpc::ServerContext* context, const v1::WatchJobRequest* request,
                                     grpc::ServerWriter<v1::WatchJobResponse>* writer) {
  return guarded([&]() -> grpc::Status {
    const Slot slot(watches_, kMaxWatches);
    if (!slot.granted()) return too_many("jobs are being watched");
    StallWatch::Call call(stalls_, *context);
    const JobId id{request->job_id()};
    JobStatus status = farm_.job(id);
    for (;;) {
      v1::WatchJobResponse message;
      *message.mutable_job() = to_proto(status);
      if (!call.write(*writer, message)) return grpc::Status::CANCELLED;
      if (is_final(status.state)) return grpc::Status::OK;
      std::this_thread::sleep_for(kWatchSpacing);
      status = farm_.wait(id, status.version, kWatchBeatSeconds);
      if (context->IsCancelled()) return grpc::Status::CANCELLED;
      if (stopping_) return {grpc::StatusCode::UNAVAILABLE, "the coordinator is shutting down"};
    }
  });
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

grpc::Status ClientService::FetchImage(grpc::ServerContext* context, const v1::FetchImageRequest* request,
                                       grpc::ServerWriter<v1::FetchImageResponse>* writer) {
  return guarded([&]() -> grpc::Status {
    const Slot slot(fetches_, kMaxFetches);
    if (!slot.granted()) {
      return too_many("images are being fetched");
    }
    StallWatch::Call call(stalls_, *context);
    const JobId id{request->job_id()};
    if (request->max_side() < 0) throw Error(ErrorKind::kUsage, "max_side must be 0 or above");
    Image image;
    ChannelImage aovs;
    if (request->max_side() > 0) {
      image = reduced(farm_.display_image(id), request->max_side());
    } else if (request->with_aovs()) {
      aovs = farm_.aovs(id, &image);
    } else {
      image = request->for_display() ? farm_.display_image(id) : farm_.image(id);
    }
    v1::FetchImageResponse message;
    v1::FetchImageResponse::Header& header = *message.mutable_header();
    header.set_width(image.width);
    header.set_height(image.height);
    header.set_channels(image.channels);
    for (const auto& [key, value] : farm_.image_metadata(id)) (*header.mutable_metadata())[key] = value;
    for (const std::string& name : aovs.channels) header.add_aov_channels(name);
    if (!call.write(*writer, message)) return grpc::Status::CANCELLED;
    for (const Image* part : {&image, &aovs.image}) {
      const std::string_view bytes(reinterpret_cast<const char*>(part->data.data()),
                                   part->data.size() * sizeof(float));
      for (size_t at = 0; at < bytes.size(); at += kChunkBytes) {
        message.set_chunk(std::string(bytes.substr(at, kChunkBytes)));
        if (!call.write(*writer, message)) return grpc::Status::CANCELLED;
      }
    }
    return grpc::Status::OK;
  });
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

grpc::Status ClientService::UploadBlobs(grpc::ServerContext* context,
                                        grpc::ServerReader<v1::UploadBlobsRequest>* reader,
                                        v1::UploadBlobsResponse* response) {
  return guarded([&]() -> grpc::Status {
    const Slot slot(uploads_, kMaxUploads);
    if (!slot.granted()) return too_many("scenes are being uploaded");
    StallWatch::Call call(stalls_, *context);
    std::optional<BlobStore::Writer> writer;
    int64_t blobs = 0;
    uint64_t bytes = 0;
    v1::UploadBlobsRequest message;
    while (call.read(*reader, &message)) {
      if (message.has_header()) {
        if (writer) writer->finish();
        writer.reset();
        if (message.header().size() > quotas_.max_bundle_bytes - bytes) {
          throw LimitReached("an upload of more than " + std::to_string(quotas_.max_bundle_bytes) +
                             " bytes (the coordinator's --max-bundle-mb)");
        }
        writer.emplace(blobs_.begin(message.header().digest(), message.header().size()));
        ++blobs;
        bytes += message.header().size();
      } else if (writer && message.chunk().size() <= kMaxUploadChunk) {
        writer->write(message.chunk());
      } else {
        throw Error(ErrorKind::kUsage,
                    writer ? "an upload chunk is over 4 MiB" : "an upload begins with a header");
      }
    }
    if (writer) writer->finish();
    response->set_blobs(blobs);
    response->set_bytes(bytes);
    return grpc::Status::OK;
  });
}

}  // namespace lightmill
