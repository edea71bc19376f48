#include "client/farm_client.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstring>
#include <fstream>
#include <thread>

#include "common/digest.h"
#include "common/error.h"
#include "common/rpc/channel.h"
#include "common/rpc/convert.h"
#include "common/rpc/coordinators.h"
#include "common/rpc/status.h"
#include "common/rpc/tls_diagnosis.h"
#include "lightmill/v1/client.grpc.pb.h"

namespace lightmill::client {
namespace {

static_assert(std::endian::native == std::endian::little, "images travel as little-endian floats");

constexpr double kFirstAnswerSeconds = 8;  // "is anybody there?" within a few seconds
constexpr double kLookSeconds = 3;         // whether a coordinator is there, and leads
constexpr double kTransferSeconds = 3600;  // uploads and images
constexpr double kWatchSeconds = 86400;    // a stream; it is opened again when it ends by this
constexpr double kConnectSeconds = 6;      // patience of a first connection: a coordinator may be starting
constexpr double kReconnectSeconds = 60;   // a coordinator that restarts is back by then
constexpr size_t kDigestsAtOnce = 10000;
constexpr int kMaxAovChannels = 64;

/// The bytes of a blob to upload: a file, or memory.
class BlobBytes {
 public:
  BlobBytes(const std::string& path, std::string memory) : memory_(std::move(memory)) {
    if (path.empty()) return;
    file_.open(path, std::ios::binary);
    if (!file_) throw Error(ErrorKind::kFailed, path + ": cannot be read");
  }
  /// The next chunk; empty at the end.
  std::string next() {
    std::string chunk;
    if (file_.is_open()) {
      chunk.resize(kChunkBytes);
      file_.read(chunk.data(), static_cast<std::streamsize>(chunk.size()));
      chunk.resize(static_cast<size_t>(file_.gcount()));
    } else {
      chunk = memory_.substr(position_, kChunkBytes);
      position_ += chunk.size();
    }
    return chunk;
  }

 private:
  std::ifstream file_;
  std::string memory_;
  size_t position_ = 0;
};

constexpr int kJobsPerPage = 500;
constexpr size_t kMostJobs = 1000000;  // ten times what a coordinator takes

struct PendingBlob {
  std::string digest;
  uint64_t size = 0;
  std::string path;  // empty: `memory` holds it
  std::string memory;
};

std::string pixel_bytes(const Image& image) {
  return {reinterpret_cast<const char*>(image.data.data()), image.data.size() * sizeof(float)};
}

bool is_loss(grpc::StatusCode code) {
  return code == grpc::StatusCode::UNAVAILABLE || code == grpc::StatusCode::DEADLINE_EXCEEDED ||
         code == grpc::StatusCode::CANCELLED || code == grpc::StatusCode::UNKNOWN ||
         code == grpc::StatusCode::INTERNAL;
}

}  // namespace

struct FarmClient::Impl {
  explicit Impl(const std::string& addresses) : coordinators(addresses) {}
  Coordinators coordinators;
  SecurityFiles security;
  std::vector<std::unique_ptr<v1::ClientService::Stub>> stubs;  // one to a coordinator
  bool met = false;                                             // one that leads was found

  const std::string& address() const { return coordinators.address(coordinators.current()); }
  /// Of the one to call; of several, one that leads if any does.
  v1::ClientService::Stub* stub() {
    if (!met) find_leader();
    return stubs[coordinators.current()].get();
  }

  /// A call that changes nothing tells who leads: calls that do must not be repeated elsewhere.
  void find_leader() {
    for (size_t tries = 0; coordinators.size() > 1 && tries < coordinators.size(); ++tries) {
      const size_t current = coordinators.current();
      grpc::ClientContext context;
      set_deadline(context, kLookSeconds);
      v1::GetJobResponse response;
      const grpc::Status status = stubs[current]->GetJob(&context, v1::GetJobRequest(), &response);
      if (status.error_code() != grpc::StatusCode::UNAVAILABLE &&
          status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED) {
        break;
      }
      coordinators.move_on(current);
    }
    met = true;
  }

  /// Throws what a status means. If nobody could be reached, TLS may be why; gRPC does not say.
  void require_ok(const grpc::Status& status) const {
    if (status.error_code() == grpc::StatusCode::UNAVAILABLE) {
      const std::string problem = diagnose_tls(address(), security).problem;
      if (!problem.empty()) throw Error(ErrorKind::kUnreachable, "coordinator " + address() + ": " + problem);
    }
    throw_if_failed(status, address());
  }

  template <class Request, class Response>
  Response call(grpc::Status (v1::ClientService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                Response*),
                const Request& request) {
    v1::ClientService::Stub* const leader = stub();
    grpc::ClientContext context;
    set_deadline(context, kFirstAnswerSeconds);
    Response response;
    require_ok((leader->*method)(&context, request, &response));
    return response;
  }

  template <class Request, class Response>
  JobStatus change(grpc::Status (v1::ClientService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                   Response*),
                   const JobId& id) {
    Request request;
    request.set_job_id(id.value);
    return from_proto(call(method, request).job());
  }

  std::vector<PendingBlob> missing_of(std::vector<PendingBlob> blobs) {
    std::map<std::string, PendingBlob> by_digest;
    for (PendingBlob& blob : blobs) by_digest.emplace(blob.digest, std::move(blob));
    std::vector<std::string> digests;
    digests.reserve(by_digest.size());
    for (const auto& [digest, blob] : by_digest) digests.push_back(digest);
    std::vector<PendingBlob> missing;
    for (size_t first = 0; first < digests.size(); first += kDigestsAtOnce) {
      v1::FindMissingBlobsRequest request;
      for (size_t i = first; i < std::min(digests.size(), first + kDigestsAtOnce); ++i) {
        request.add_digests(digests[i]);
      }
      const auto response = call(&v1::ClientService::Stub::FindMissingBlobs, request);
      for (const std::string& digest : response.digests()) {
        const auto found = by_digest.find(digest);
        if (found != by_digest.end()) missing.push_back(std::move(found->second));
      }
    }
    return missing;
  }

  void upload(const std::vector<PendingBlob>& blobs, const std::function<void(uint64_t sent)>& progress) {
    uint64_t sent = 0;
    grpc::ClientContext context;
    set_deadline(context, kTransferSeconds);
    v1::UploadBlobsResponse response;
    const auto writer = stub()->UploadBlobs(&context, &response);
    bool open = true;
    for (const PendingBlob& blob : blobs) {
      if (!open) break;
      v1::UploadBlobsRequest message;
      message.mutable_header()->set_digest(blob.digest);
      message.mutable_header()->set_size(blob.size);
      open = writer->Write(message);
      BlobBytes bytes(blob.path, blob.memory);
      for (std::string chunk = bytes.next(); open && !chunk.empty(); chunk = bytes.next()) {
        sent += chunk.size();
        message.set_chunk(std::move(chunk));
        open = writer->Write(message);
        progress(sent);
      }
    }
    writer->WritesDone();
    require_ok(writer->Finish());
  }
};

FarmClient::FarmClient(const ConnectionOptions& connection)
    : impl_(std::make_unique<Impl>(connection.coordinator)) {
  impl_->security = resolve(connection.security, Side::kClient);
  for (size_t i = 0; i < impl_->coordinators.size(); ++i) {
    impl_->stubs.push_back(v1::ClientService::NewStub(
        make_channel({impl_->coordinators.address(i), connection.insecure, impl_->security})));
  }
}
FarmClient::~FarmClient() = default;

JobId FarmClient::submit(const JobRequest& request, const std::map<std::string, std::string>& blob_paths,
                         const UploadProgress& uploading) {
  std::vector<PendingBlob> blobs;
  for (const BundleEntry& entry : request.bundle.entries) {
    const auto path = blob_paths.find(entry.digest);
    if (path == blob_paths.end()) throw std::logic_error("a bundle entry without a file");
    blobs.push_back({entry.digest, entry.size, path->second, ""});
  }
  v1::SubmitJobRequest message;
  if (!request.reference.data.empty()) {
    std::string bytes = pixel_bytes(request.reference);
    v1::Reference& reference = *message.mutable_reference();
    reference.set_digest(sha256_hex(bytes));
    reference.set_width(request.reference.width);
    reference.set_height(request.reference.height);
    const uint64_t size = bytes.size();
    blobs.push_back({reference.digest(), size, "", std::move(bytes)});
  }
  const std::vector<PendingBlob> missing = impl_->missing_of(std::move(blobs));
  if (!missing.empty()) {
    uint64_t bytes = 0;
    for (const PendingBlob& blob : missing) bytes += blob.size;
    uploading(missing.size(), 0, bytes);
    impl_->upload(missing, [&](uint64_t sent) { uploading(missing.size(), sent, bytes); });
  }
  message.set_name(one_line(request.name));
  message.set_bundle_json(bundle_to_json(request.bundle));
  message.set_settings_json(settings_to_json(request.settings));
  message.set_priority(request.priority);
  message.set_pool(request.pool);
  message.set_submitter(one_line(request.submitter));
  message.set_max_workers(request.max_workers);
  for (const JobId& id : request.after) message.add_after(id.value);
  return JobId{impl_->call(&v1::ClientService::Stub::SubmitJob, message).job_id()};
}

JobStatus FarmClient::job(const JobId& id) { return impl_->change(&v1::ClientService::Stub::GetJob, id); }
JobStatus FarmClient::pause(const JobId& id) { return impl_->change(&v1::ClientService::Stub::PauseJob, id); }
JobStatus FarmClient::resume(const JobId& id) {
  return impl_->change(&v1::ClientService::Stub::ResumeJob, id);
}
JobStatus FarmClient::cancel(const JobId& id) {
  return impl_->change(&v1::ClientService::Stub::CancelJob, id);
}
JobStatus FarmClient::retry(const JobId& id) { return impl_->change(&v1::ClientService::Stub::RetryJob, id); }

JobStatus FarmClient::extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
                             std::optional<double> target_error) {
  v1::ExtendJobRequest request;
  request.set_job_id(id.value);
  if (spp) request.set_spp(*spp);
  if (time_s) request.set_time_seconds(*time_s);
  if (target_error) request.set_target_error(*target_error);
  return from_proto(impl_->call(&v1::ClientService::Stub::ExtendJob, request).job());
}

std::optional<PilotReport> FarmClient::pilot(const JobId& id) {
  v1::GetJobRequest request;
  request.set_job_id(id.value);
  const auto response = impl_->call(&v1::ClientService::Stub::GetJob, request);
  if (!response.has_pilot_json()) return std::nullopt;
  return pilot_from_json(response.pilot_json());
}

std::vector<JobStatus> FarmClient::jobs() {
  std::vector<JobStatus> list;
  v1::ListJobsRequest request;
  request.set_page_size(kJobsPerPage);
  for (;;) {
    const auto response = impl_->call(&v1::ClientService::Stub::ListJobs, request);
    for (const v1::JobStatus& job : response.jobs()) list.push_back(from_proto(job));
    // A coordinator that repeats itself, or goes on for ever, does not hold us.
    if (response.next_page_token().empty() || response.jobs().empty() ||
        response.next_page_token() == request.page_token() || list.size() >= kMostJobs) {
      return list;
    }
    request.set_page_token(response.next_page_token());
  }
}

std::vector<WorkerStatus> FarmClient::workers() {
  std::vector<WorkerStatus> list;
  const auto response = impl_->call(&v1::ClientService::Stub::ListWorkers, v1::ListWorkersRequest());
  for (const v1::WorkerStatus& worker : response.workers()) list.push_back(from_proto(worker));
  return list;
}

std::vector<TileStatus> FarmClient::tiles(const JobId& id) {
  grpc::ClientContext context;
  set_deadline(context, kTransferSeconds);
  v1::ListTilesRequest request;
  request.set_job_id(id.value);
  const auto reader = impl_->stub()->ListTiles(&context, request);
  std::vector<TileStatus> list;
  v1::ListTilesResponse message;
  while (reader->Read(&message)) {
    for (const v1::TileStatus& tile : message.tiles()) list.push_back(from_proto(tile));
  }
  impl_->require_ok(reader->Finish());
  return list;
}

std::vector<TileLogLine> FarmClient::logs(const JobId& id, const std::optional<int64_t>& tile, int64_t most) {
  grpc::ClientContext context;
  set_deadline(context, kTransferSeconds);
  v1::GetLogsRequest request;
  request.set_job_id(id.value);
  if (tile) request.set_tile_id(*tile);
  request.set_max_lines(most);
  const auto reader = impl_->stub()->GetLogs(&context, request);
  std::vector<TileLogLine> list;
  v1::GetLogsResponse message;
  while (reader->Read(&message)) {
    for (const v1::LogLine& line : message.lines())
      list.push_back({line.time(), line.tile_id(), line.attempt(), line.worker_id(), line.text()});
  }
  impl_->require_ok(reader->Finish());
  return list;
}

JobStatus FarmClient::watch(const JobId& id, const std::function<void(const JobStatus&)>& observe,
                            const std::function<void(const std::string&)>& lost) {
  using Steady = std::chrono::steady_clock;
  JobStatus last;
  bool connected = false, complained = false;
  bool is_lost = false;
  Steady::time_point lost_at{};
  for (;;) {
    grpc::ClientContext context;
    set_deadline(context, kWatchSeconds);
    v1::WatchJobRequest request;
    request.set_job_id(id.value);
    const auto reader = impl_->stub()->WatchJob(&context, request);
    v1::WatchJobResponse message;
    while (reader->Read(&message)) {
      last = from_proto(message.job());
      connected = true;
      complained = false;
      is_lost = false;
      observe(last);
    }
    const grpc::Status status = reader->Finish();
    if (status.ok() && is_final(last.state)) return last;
    if (!status.ok() && !is_loss(status.error_code())) impl_->require_ok(status);
    impl_->met = false;
    if (!is_lost) lost_at = Steady::now();
    is_lost = true;
    const double seconds = std::chrono::duration<double>(Steady::now() - lost_at).count();
    if (!connected && diagnose_tls(impl_->address(), impl_->security).definite) impl_->require_ok(status);
    if (!connected && seconds > kConnectSeconds) impl_->require_ok(status);
    if (seconds > kReconnectSeconds) {
      throw Error(ErrorKind::kUnreachable,
                  "coordinator " + impl_->address() +
                      " did not come back; the job goes on once it does: lightmill watch " + id.value);
    }
    if (connected && !complained && !status.ok()) {
      lost("lost the coordinator at " + impl_->address() + "; trying again");
      complained = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
}

FetchedImage FarmClient::fetch(const JobId& id, bool with_aovs, int max_side) {
  grpc::ClientContext context;
  set_deadline(context, kTransferSeconds);
  v1::FetchImageRequest request;
  request.set_job_id(id.value);
  request.set_with_aovs(with_aovs);
  request.set_max_side(max_side);
  const auto reader = impl_->stub()->FetchImage(&context, request);
  FetchedImage fetched;
  size_t filled = 0, size = 0, aov_size = 0;
  v1::FetchImageResponse message;
  const auto malformed = [&] {
    return Error(ErrorKind::kFailed,
                 impl_->address() + " sent a malformed image; is it of the same version?");
  };
  const auto refuse = [&] {
    context.TryCancel();
    reader->Finish();
    throw malformed();
  };
  while (reader->Read(&message)) {
    if (message.has_header()) {
      const auto& header = message.header();
      if (size != 0 || header.width() < 1 || header.height() < 1 || header.channels() != 3 ||
          header.aov_channels_size() > kMaxAovChannels ||
          int64_t{header.width()} * header.height() > kMaxPixels) {
        refuse();
      }
      fetched.image = Image(header.width(), header.height(), 3);
      fetched.aovs.channels = {header.aov_channels().begin(), header.aov_channels().end()};
      if (header.aov_channels_size() > 0) {
        fetched.aovs.image = Image(header.width(), header.height(), header.aov_channels_size());
      }
      size = fetched.image.data.size() * sizeof(float);
      aov_size = fetched.aovs.image.data.size() * sizeof(float);
      fetched.metadata = {header.metadata().begin(), header.metadata().end()};
      continue;
    }
    std::string_view chunk = message.chunk();
    if (chunk.size() > size + aov_size - filled) refuse();
    while (!chunk.empty()) {
      const bool colour = filled < size;
      char* to = colour ? reinterpret_cast<char*>(fetched.image.data.data()) + filled
                        : reinterpret_cast<char*>(fetched.aovs.image.data.data()) + (filled - size);
      const size_t count = colour ? std::min(chunk.size(), size - filled) : chunk.size();
      std::memcpy(to, chunk.data(), count);
      filled += count;
      chunk.remove_prefix(count);
    }
  }
  impl_->require_ok(reader->Finish());
  if (size == 0 || filled != size + aov_size) throw malformed();
  return fetched;
}

ErrorCurve FarmClient::curve(const JobId& id) {
  v1::GetCurveRequest request;
  request.set_job_id(id.value);
  return from_proto(impl_->call(&v1::ClientService::Stub::GetCurve, request).curve());
}

}  // namespace lightmill::client
