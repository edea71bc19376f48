#include "coordinator/worker_service.h"

#include <algorithm>
#include <chrono>
#include <fstream>

#include "common/digest.h"
#include "common/log.h"
#include "common/rpc/channel.h"
#include "common/rpc/convert.h"
#include "coordinator/service_status.h"
#include "coordinator/slot.h"

namespace lightmill {
namespace {

constexpr int kMaxHeld = 10000;
constexpr int kMaxAskedBlobs = 10000;
constexpr uint64_t kMaxIncomingBytes = uint64_t{4} << 30;
/// As many calls may wait for work, each with a thread; others are answered at once and come again.
constexpr int kMaxWaiting = 200;
/// A long poll looks this often whether its caller is still there.
constexpr double kPollSliceSeconds = 0.5;

/// Bytes that a call may hold, given back on every way out.
class Reservation {
 public:
  explicit Reservation(std::atomic<uint64_t>& total) : total_(total) {}
  ~Reservation() { total_ -= bytes_; }
  Reservation(const Reservation&) = delete;
  Reservation& operator=(const Reservation&) = delete;
  bool take(uint64_t bytes) {
    bytes_ = bytes;
    return (total_ += bytes) <= kMaxIncomingBytes || total_ == bytes;  // a single one always fits
  }

 private:
  std::atomic<uint64_t>& total_;
  uint64_t bytes_ = 0;
};

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

LogContext about(const std::string& worker, const LeaseKey& key) {
  return {key.job.value, key.tile.value, key.attempt, worker};
}

const char* outcome_text(CommitResult result) {
  switch (result) {
    case CommitResult::kAccepted:
    case CommitResult::kAlreadyCommitted:
      return "";
    case CommitResult::kStale:
      return "the lease was lost before the commit";
    case CommitResult::kCorrupt:
      return "the partial does not fit its tile or is damaged; see the coordinator's log";
    case CommitResult::kUnknownJob:
      return "no such job or tile, or the job was cancelled";
  }
  return "";
}

}  // namespace

grpc::Status WorkerService::Register(grpc::ServerContext*, const v1::RegisterRequest* request,
                                     v1::RegisterResponse* response) {
  return guarded([&] {
    response->set_worker_id(farm_.register_worker(from_proto(request->registration())).value);
    response->set_lease_seconds(lease_seconds_);
    return grpc::Status::OK;
  });
}

grpc::Status WorkerService::Lease(grpc::ServerContext* context, const v1::LeaseRequest* request,
                                  v1::LeaseResponse* response) {
  return guarded([&]() -> grpc::Status {
    const double wait = request->wait_seconds();
    if (!(wait >= 0 && wait <= kMaxPollSeconds))
      throw Error(ErrorKind::kUsage, "wait_seconds must be 0 to 20");
    const Slot may_wait(waiting_, kMaxWaiting);
    const auto begin = std::chrono::steady_clock::now();
    const auto end = begin + std::chrono::duration<double>(may_wait.granted() ? wait : 0.0);
    for (;;) {
      const double left = std::chrono::duration<double>(end - std::chrono::steady_clock::now()).count();
      // In slices, so that a caller that hung up gets no lease.
      const auto grant =
          farm_.lease(WorkerId{request->worker_id()}, std::clamp(left, 0.0, kPollSliceSeconds));
      if (grant) {
        metrics_.lease_granted(seconds_since(begin));
        const LogScope scope(about(request->worker_id(), {grant->job, grant->tile_id, grant->attempt}));
        tile_log_.add("leased");
        *response->mutable_grant() = to_proto(*grant);
        return grpc::Status::OK;
      }
      if (stopping_) return {grpc::StatusCode::UNAVAILABLE, "the coordinator is shutting down"};
      if (context->IsCancelled()) return grpc::Status::CANCELLED;
      if (std::chrono::steady_clock::now() >= end) return grpc::Status::OK;
    }
  });
}

grpc::Status WorkerService::Renew(grpc::ServerContext*, const v1::RenewRequest* request,
                                  v1::RenewResponse* response) {
  return guarded([&] {
    if (request->held_size() > kMaxHeld) throw Error(ErrorKind::kUsage, "more than 10000 leases at once");
    std::vector<LeaseKey> held;
    for (const v1::LeaseKey& key : request->held()) held.push_back(from_proto(key));
    for (const LeaseKey& key : farm_.renew(WorkerId{request->worker_id()}, held)) {
      *response->add_lost() = to_proto(key);
    }
    return grpc::Status::OK;
  });
}

grpc::Status WorkerService::Commit(grpc::ServerContext*, grpc::ServerReader<v1::CommitRequest>* reader,
                                   v1::CommitResponse* response) {
  return guarded([&]() -> grpc::Status {
    v1::CommitRequest message;
    if (!reader->Read(&message) || !message.has_header()) {
      throw Error(ErrorKind::kUsage, "a commit begins with a header");
    }
    const v1::CommitRequest::Header header = message.header();
    const LeaseKey key = from_proto(header.key());
    const uint64_t limit = farm_.max_partial_bytes(key);
    if (limit == 0) {
      response->set_outcome(v1::COMMIT_OUTCOME_UNKNOWN_JOB);
      response->set_message(outcome_text(CommitResult::kUnknownJob));
      return grpc::Status::OK;
    }
    if (header.size() > limit) {
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, "the partial is larger than any of its tile can be"};
    }
    Reservation reservation(incoming_bytes_);
    if (!reservation.take(header.size())) {
      return {grpc::StatusCode::RESOURCE_EXHAUSTED,
              "too many partials are being received at once; try again"};
    }
    std::string bytes;  // grows as chunks arrive: an announced size alone allocates nothing
    while (reader->Read(&message)) {
      if (message.has_header()) throw Error(ErrorKind::kUsage, "a second header in a commit");
      if (bytes.size() + message.chunk().size() > header.size()) {
        throw Error(ErrorKind::kUsage, "the partial is longer than announced");
      }
      bytes += message.chunk();
    }
    if (bytes.size() != header.size())
      throw Error(ErrorKind::kUsage, "the partial is shorter than announced");
    if (sha256_hex(bytes) != header.digest()) {
      throw Error(ErrorKind::kUsage, "the partial was damaged on its way: its digest differs");
    }
    const LogScope scope(about(header.worker_id(), key));
    std::string reason;
    const auto arrived = std::chrono::steady_clock::now();
    const CommitResult result = farm_.commit(WorkerId{header.worker_id()}, key, bytes, &reason);
    if (result == CommitResult::kAccepted) metrics_.committed(seconds_since(arrived));
    response->set_outcome(to_proto(result));
    response->set_message(reason.empty() ? outcome_text(result) : one_line(reason));
    if (result == CommitResult::kAccepted) {
      tile_log_.add("committed: " + std::to_string(bytes.size()) + " bytes");
    } else if (result != CommitResult::kCorrupt) {  // of that the farm's own log speaks
      tile_log_.add(result == CommitResult::kAlreadyCommitted ? "committed once more"
                                                              : "not committed: " + response->message());
    }
    return grpc::Status::OK;
  });
}

grpc::Status WorkerService::Fail(grpc::ServerContext*, const v1::FailRequest* request, v1::FailResponse*) {
  return guarded([&] {
    const LeaseKey key = from_proto(request->key());
    const LogScope scope(about(request->worker_id(), key));
    if (request->handed_back()) {
      farm_.hand_back(WorkerId{request->worker_id()}, key);
      tile_log_.add("handed back");
    } else {
      farm_.fail(WorkerId{request->worker_id()}, key, one_line(request->reason()));
    }
    return grpc::Status::OK;
  });
}

grpc::Status WorkerService::Drain(grpc::ServerContext*, const v1::DrainRequest* request, v1::DrainResponse*) {
  return guarded([&] {
    farm_.drain(WorkerId{request->worker_id()});
    return grpc::Status::OK;
  });
}

grpc::Status WorkerService::GetBundle(grpc::ServerContext*, const v1::GetBundleRequest* request,
                                      v1::GetBundleResponse* response) {
  return guarded([&]() -> grpc::Status {
    try {
      response->set_bundle_json(bundle_to_json(farm_.bundle(request->bundle_digest())));
    } catch (const StoreError&) {
      throw;
    } catch (const Error& e) {
      return {grpc::StatusCode::NOT_FOUND, one_line(e.what())};
    }
    return grpc::Status::OK;
  });
}

grpc::Status WorkerService::FetchBlobs(grpc::ServerContext*, const v1::FetchBlobsRequest* request,
                                       grpc::ServerWriter<v1::FetchBlobsResponse>* writer) {
  return guarded([&]() -> grpc::Status {
    if (request->digests_size() > kMaxAskedBlobs)
      throw Error(ErrorKind::kUsage, "more than 10000 blobs at once");
    std::string chunk;
    for (const std::string& digest : request->digests()) {
      if (!blobs_.contains(digest)) {
        return {grpc::StatusCode::NOT_FOUND, "the coordinator has no blob " + digest};
      }
      std::ifstream in(blobs_.path(digest), std::ios::binary);
      v1::FetchBlobsResponse message;
      message.mutable_header()->set_digest(digest);
      message.mutable_header()->set_size(blobs_.size(digest));
      if (!writer->Write(message)) return grpc::Status::CANCELLED;
      chunk.resize(kChunkBytes);
      while (in.read(chunk.data(), static_cast<std::streamsize>(chunk.size())) || in.gcount() > 0) {
        message.set_chunk(chunk.substr(0, static_cast<size_t>(in.gcount())));
        if (!writer->Write(message)) return grpc::Status::CANCELLED;
      }
      if (in.bad()) throw StoreError("blob " + digest + " can't be read");
    }
    return grpc::Status::OK;
  });
}

}  // namespace lightmill
