#include "coordinator/service/worker_service.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "common/base/digest.h"
#include "common/base/log.h"
#include "common/rpc/channel.h"
#include "common/rpc/convert.h"
#include "common/rpc/registration_digest.h"
#include "coordinator/farm/farm_errors.h"
#include "coordinator/service/limits/in_flight_limit.h"
#include "coordinator/service/service_status.h"

namespace lightmill {
namespace {

constexpr int kMaxHeld = 10000;
constexpr int kMaxAskedBlobs = 10000;
/// Workers that fetch scene files at once, each with a thread. Beyond, the slowest makes room.
constexpr size_t kMaxFetches = 64;
/// As many calls may wait for work, each with a thread; others are answered at once and come again.
constexpr int kMaxWaiting = 200, kMaxWaitingStrangers = 100;
/// As many partials are decoded and merged at once.
constexpr size_t kMaxCommitting = 32;
/// Partials that come in at once, as far as their memory allows.
constexpr size_t kMaxCommits = 8192;
/// A long poll looks this often whether its caller is still there.
constexpr double kPollSliceSeconds = 0.5;

/// Bytes that a call may hold, given back on every way out.
class Reservation {
 public:
  Reservation(std::atomic<uint64_t>& total, uint64_t most) : total_(total), most_(most) {}
  ~Reservation() { total_ -= bytes_; }
  Reservation(const Reservation&) = delete;
  Reservation& operator=(const Reservation&) = delete;
  bool take(uint64_t bytes) {
    bytes_ = bytes;
    return (total_ += bytes) <= most_ || total_ == bytes;  // a single one always fits
  }

 private:
  std::atomic<uint64_t>& total_;
  const uint64_t most_;
  uint64_t bytes_ = 0;
};

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

LogContext about(const WorkerId& worker, const LeaseKey& key) {
  return {key.job.value, key.tile.value, key.attempt, worker.value};
}

/// Tells a worker which blobs the coordinator has lost.
template <class Response>
void name_wanted(const WantedBlobs* wanted, Response* response) {
  if (!wanted) return;
  for (std::string& digest : wanted->named()) response->add_wanted_blobs(std::move(digest));
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

grpc::Status WorkerService::Register(grpc::ServerContext* context, const v1::RegisterRequest* request,
                                     v1::RegisterResponse* response) {
  const auto& metadata = context->client_metadata();
  const auto sent = metadata.find(kRegistrationDigestKey);
  if (sent != metadata.end() && sent->second != registration_digest(request->registration())) {
    // The worker tries again.
    return {grpc::StatusCode::UNAVAILABLE, "the registration was damaged on its way: its digest differs"};
  }
  return guarded([&] {
    const std::string owner = caller_ ? caller_(*context) : "";
    response->set_worker_id(keys_.name_of(farm_.register_worker(from_proto(request->registration()), owner)));
    response->set_lease_seconds(lease_seconds_);
    return grpc::Status::OK;
  });
}

WorkerService::WorkerService(Farm& farm, BlobStore& blobs, Metrics& metrics, TileLog& tile_log,
                             StallWatch& stalls, const Quotas& quotas, double lease_seconds, Caller caller,
                             WantedBlobs* wanted)
    : farm_(farm),
      blobs_(blobs),
      metrics_(metrics),
      tile_log_(tile_log),
      stalls_(stalls),
      lease_seconds_(lease_seconds),
      caller_(std::move(caller)),
      wanted_(wanted),
      most_incoming_bytes_(quotas.incoming_bytes),
      fetches_(stalls, kMaxFetches),
      commits_(stalls, kMaxCommits),
      flush_queue_([this] { farm_.flush(); }),
      waiting_pool_(kMaxWaiting + kMaxCommitting),
      commit_pool_(kMaxCommitting) {}

void WorkerService::grant(const WorkerId& worker, const LeaseGrant& granted, double waited,
                          v1::LeaseResponse* response) {
  metrics_.lease_granted(waited);
  const LogScope scope(about(worker, {granted.job, granted.tile_id, granted.attempt}));
  tile_log_.add("leased");
  *response->mutable_grant() = to_proto(granted);
  name_wanted(wanted_, response);
}

grpc::ServerUnaryReactor* WorkerService::Lease(grpc::CallbackServerContext* context,
                                               const v1::LeaseRequest* request, v1::LeaseResponse* response) {
  grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
  bool wait = false;
  WorkerId worker;
  const grpc::Status status = guarded([&]() -> grpc::Status {
    const double seconds = request->wait_seconds();
    if (!(seconds >= 0 && seconds <= kMaxPollSeconds))
      throw Error(ErrorKind::kUsage, "wait_seconds must be 0 to 20");
    const auto begin = std::chrono::steady_clock::now();
    worker = keys_.worker_of(request->worker_id());
    const auto granted = farm_.lease_at_once(worker);
    if (granted) grant(worker, *granted, seconds_since(begin), response);
    wait = !granted;
    return grpc::Status::OK;
  });
  if (wait) {
    waiting_pool_.run([=, this, seconds = request->wait_seconds()] {
      reactor->Finish(guarded([&] { return wait_for_lease(context, worker, seconds, response); }));
    });
  } else {
    reactor->Finish(status);
  }
  return reactor;
}

grpc::Status WorkerService::wait_for_lease(grpc::CallbackServerContext* context, const WorkerId& worker,
                                           double seconds, v1::LeaseResponse* response) {
  const Slot slot(waiting_, kMaxWaiting);
  std::optional<Slot> as_stranger;  // who has delivered something has places that others can't take
  if (!farm_.is_proven(worker)) as_stranger.emplace(waiting_strangers_, kMaxWaitingStrangers);
  const bool may_wait = slot.granted() && (!as_stranger || as_stranger->granted());
  const auto begin = std::chrono::steady_clock::now();
  const auto end = begin + std::chrono::duration<double>(may_wait ? seconds : 0.0);
  for (;;) {
    const double left = std::chrono::duration<double>(end - std::chrono::steady_clock::now()).count();
    // In slices, so that a caller that hung up gets no lease.
    const auto granted = farm_.lease(worker, std::clamp(left, 0.0, kPollSliceSeconds));
    if (granted) {
      grant(worker, *granted, seconds_since(begin), response);
      return grpc::Status::OK;
    }
    if (stopping_) return {grpc::StatusCode::UNAVAILABLE, "the coordinator is shutting down"};
    if (context->IsCancelled()) return grpc::Status::CANCELLED;
    if (std::chrono::steady_clock::now() >= end) {
      name_wanted(wanted_, response);
      return grpc::Status::OK;
    }
  }
}

grpc::Status WorkerService::Renew(grpc::ServerContext*, const v1::RenewRequest* request,
                                  v1::RenewResponse* response) {
  return guarded([&] {
    if (request->held_size() > kMaxHeld) throw Error(ErrorKind::kUsage, "more than 10000 leases at once");
    std::vector<LeaseKey> held;
    for (const v1::LeaseKey& key : request->held()) held.push_back(from_proto(key));
    for (const LeaseKey& key : farm_.renew(keys_.worker_of(request->worker_id()), held)) {
      *response->add_lost() = to_proto(key);
    }
    name_wanted(wanted_, response);
    return grpc::Status::OK;
  });
}

/// Receives header and chunks, then has them committed. Deletes itself.
class WorkerService::CommitCall final : public grpc::ServerReadReactor<v1::CommitRequest> {
 public:
  CommitCall(WorkerService& service, grpc::CallbackServerContext& context, v1::CommitResponse* response)
      : service_(service),
        response_(response),
        reservation_(service.incoming_bytes_, service.most_incoming_bytes_),
        stall_(service.stalls_, context, &service.commits_) {
    read();
  }

  void OnReadDone(bool ok) override {
    stall_.end(ok ? message_.ByteSizeLong() : 0);
    bool whole = false;
    const grpc::Status status = guarded([&]() -> grpc::Status {
      if (!begun_) return begin(ok);
      if (ok) return add_chunk();
      whole = true;
      return grpc::Status::OK;
    });
    if (!status.ok() || answered_) {
      Finish(status);
    } else if (whole) {
      service_.commit_pool_.run([this] { merge(); });
    } else {
      read();
    }
  }
  void OnDone() override { delete this; }

 private:
  void read() {
    stall_.begin();
    StartRead(&message_);
  }
  grpc::Status begin(bool ok) {
    if (!ok || !message_.has_header()) throw Error(ErrorKind::kUsage, "a commit begins with a header");
    if (!stall_.admitted()) throw LimitReached("too many partials come in at once; try again");
    begun_ = true;
    header_ = message_.header();
    worker_ = service_.keys_.worker_of(header_.worker_id());  // throws UnknownWorker before memory is spent
    const uint64_t limit = service_.farm_.max_partial_bytes(from_proto(header_.key()));
    if (limit == 0) {
      response_->set_outcome(v1::COMMIT_OUTCOME_UNKNOWN_JOB);
      response_->set_message(outcome_text(CommitResult::kUnknownJob));
      answered_ = true;
      return grpc::Status::OK;
    }
    if (header_.size() > limit) {
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, "the partial is larger than any of its tile can be"};
    }
    if (!reservation_.take(header_.size())) {
      service_.commits_.cut_slowest(StallWatch::kSlowBytesPerSecond);  // whoever tries again finds room
      return {grpc::StatusCode::RESOURCE_EXHAUSTED,
              "partials that are coming in fill the coordinator's --commit-memory; try again"};
    }
    return grpc::Status::OK;
  }
  grpc::Status add_chunk() {
    if (message_.has_header()) throw Error(ErrorKind::kUsage, "a second header in a commit");
    if (bytes_.size() + message_.chunk().size() > header_.size()) {
      throw Error(ErrorKind::kUsage, "the partial is longer than announced");
    }
    if (bytes_.empty()) {
      bytes_ = std::move(*message_.mutable_chunk());
    } else {
      bytes_ += message_.chunk();
    }
    return grpc::Status::OK;
  }

  void merge() {
    arrived_ = std::chrono::steady_clock::now();
    const grpc::Status status = guarded([this] {
      result_ = service_.merge(worker_, header_, bytes_, &reason_);
      return grpc::Status::OK;
    });
    if (!status.ok() || !must_be_durable(result_)) return answer(status);
    service_.flush_queue_.when_durable([this](const std::exception_ptr& failure) {
      answer(guarded([&] {
        if (failure) std::rethrow_exception(failure);
        return grpc::Status::OK;
      }));
    });
  }
  void answer(const grpc::Status& status) {
    if (!status.ok()) return Finish(status);
    Finish(guarded([this] {
      service_.answer(header_, result_, reason_, seconds_since(arrived_), response_);
      return grpc::Status::OK;
    }));
  }

  WorkerService& service_;
  v1::CommitResponse* const response_;
  Reservation reservation_;
  StallWatch::Call stall_;
  v1::CommitRequest message_;
  v1::CommitRequest::Header header_;
  WorkerId worker_;
  std::string bytes_;  // grows as chunks arrive: an announced size alone allocates nothing
  bool begun_ = false, answered_ = false;
  std::chrono::steady_clock::time_point arrived_;  // all of it
  CommitResult result_ = CommitResult::kStale;
  std::string reason_;
};

grpc::ServerReadReactor<v1::CommitRequest>* WorkerService::Commit(grpc::CallbackServerContext* context,
                                                                  v1::CommitResponse* response) {
  return new CommitCall(*this, *context, response);
}

CommitResult WorkerService::merge(const WorkerId& worker, const v1::CommitRequest::Header& header,
                                  const std::string& bytes, std::string* reason) {
  if (bytes.size() != header.size()) throw Error(ErrorKind::kUsage, "the partial is shorter than announced");
  if (sha256_hex(bytes) != header.digest()) {
    throw Error(ErrorKind::kUsage, "the partial was damaged on its way: its digest differs");
  }
  const LeaseKey key = from_proto(header.key());
  const LogScope scope(about(worker, key));
  return farm_.commit_unflushed(worker, key, bytes, reason);
}

void WorkerService::answer(const v1::CommitRequest::Header& header, CommitResult result,
                           const std::string& reason, double seconds, v1::CommitResponse* response) {
  const LogScope scope(about(WorkerKeys::shown(header.worker_id()), from_proto(header.key())));
  response->set_outcome(to_proto(result));
  response->set_message(reason.empty() ? outcome_text(result) : one_line(reason));
  if (result == CommitResult::kAccepted) {
    metrics_.committed(seconds);
    tile_log_.add("committed: " + std::to_string(header.size()) + " bytes");
  } else if (result != CommitResult::kCorrupt) {  // of that the farm's own log speaks
    tile_log_.add(result == CommitResult::kAlreadyCommitted ? "committed once more"
                                                            : "not committed: " + response->message());
  }
}

grpc::Status WorkerService::Fail(grpc::ServerContext*, const v1::FailRequest* request, v1::FailResponse*) {
  return guarded([&] {
    const LeaseKey key = from_proto(request->key());
    const WorkerId worker = keys_.worker_of(request->worker_id());
    const LogScope scope(about(worker, key));
    if (request->handed_back()) {
      // First, so that the tile is not leased once more.
      if (request->missing_blob() && wanted_) {
        const std::string bundle = farm_.bundle_of(worker, key);
        if (!bundle.empty()) wanted_->missed(bundle);
      }
      farm_.hand_back(worker, key);
      tile_log_.add(request->missing_blob() ? "handed back: a file of the scene is missing" : "handed back");
    } else {
      farm_.fail(worker, key, one_line(request->reason()), from_proto(request->kind()));
    }
    return grpc::Status::OK;
  });
}

grpc::Status WorkerService::Warn(grpc::ServerContext*, const v1::WarnRequest* request, v1::WarnResponse*) {
  return guarded([&] {
    const LeaseKey key = from_proto(request->key());
    const WorkerId worker = keys_.worker_of(request->worker_id());
    const LogScope scope(about(worker, key));
    std::vector<std::string> lines;
    for (const std::string& line : request->missing_light()) lines.push_back(one_line(line));
    farm_.warn(worker, key, lines);
    return grpc::Status::OK;
  });
}

grpc::Status WorkerService::Drain(grpc::ServerContext*, const v1::DrainRequest* request, v1::DrainResponse*) {
  return guarded([&] {
    farm_.drain(keys_.worker_of(request->worker_id()));
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

grpc::Status WorkerService::FetchBlobs(grpc::ServerContext* context, const v1::FetchBlobsRequest* request,
                                       grpc::ServerWriter<v1::FetchBlobsResponse>* writer) {
  return guarded([&]() -> grpc::Status {
    StallWatch::Call call(stalls_, *context, &fetches_);
    if (!call.admitted()) {
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, "too many workers fetch scene files at once; try again"};
    }
    if (request->digests_size() > kMaxAskedBlobs)
      throw Error(ErrorKind::kUsage, "more than 10000 blobs at once");
    for (const std::string& digest : request->digests()) {
      std::optional<BlobStore::Reader> blob = blobs_.open(digest);
      if (!blob) return {grpc::StatusCode::NOT_FOUND, "the coordinator has no blob " + digest};
      v1::FetchBlobsResponse message;
      message.mutable_header()->set_digest(digest);
      message.mutable_header()->set_size(blob->size());
      if (!call.write(*writer, message)) return grpc::Status::CANCELLED;
      for (std::string_view chunk = blob->next(kChunkBytes); !chunk.empty();
           chunk = blob->next(kChunkBytes)) {
        message.set_chunk(chunk.data(), chunk.size());
        if (!call.write(*writer, message)) return grpc::Status::CANCELLED;
      }
      // The worker throws away what it got, and finds out when it asks again.
      if (!blob->finish()) return {grpc::StatusCode::DATA_LOSS, "blob " + digest + " is damaged; ask again"};
    }
    return grpc::Status::OK;
  });
}

}  // namespace lightmill
