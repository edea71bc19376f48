#include "coordinator/service/worker_service.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "common/base/log.h"
#include "common/rpc/channel.h"
#include "common/rpc/convert.h"
#include "common/rpc/pictures.h"
#include "common/rpc/registration_digest.h"
#include "coordinator/farm/farm_errors.h"
#include "coordinator/service/limits/in_flight_limit.h"
#include "coordinator/service/service_status.h"
#include "coordinator/service/streams/blob_source.h"
#include "coordinator/service/streams/sending_call.h"

namespace lightmill {
namespace {

constexpr int kMaxHeld = 10000;
constexpr size_t kMaxAskedBlobs = 10000;
/// Workers that fetch scene files at once. Beyond, the slowest makes room.
constexpr size_t kMaxFetches = 1024;
/// Threads that read these files.
constexpr size_t kFetchThreads = 8;
/// As many calls may wait for work, each with a thread; others are answered at once and come again.
constexpr int kMaxWaiting = 200, kMaxWaitingStrangers = 100;
/// For those that are answered at once.
constexpr size_t kSparePollThreads = 32;
/// A long poll looks this often whether its caller is still there.
constexpr double kPollSliceSeconds = 0.5;

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// Tells a worker which blobs the coordinator has lost.
template <class Response>
void name_wanted(const WantedBlobs* wanted, Response* response) {
  if (!wanted) return;
  for (std::string& digest : wanted->named()) response->add_wanted_blobs(std::move(digest));
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
      commits_(farm, metrics, tile_log, stalls, keys_, quotas.incoming_bytes),
      fetches_(stalls, kMaxFetches),
      waiting_pool_(kMaxWaiting + kSparePollThreads),
      fetch_pool_(kFetchThreads) {}

void WorkerService::grant(const WorkerId& worker, const LeaseGrant& granted, double waited,
                          v1::LeaseResponse* response) {
  metrics_.lease_granted(waited);
  const LogScope scope(log_context(worker, {granted.job, granted.tile_id, granted.attempt}));
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

grpc::ServerReadReactor<v1::CommitRequest>* WorkerService::Commit(grpc::CallbackServerContext* context,
                                                                  v1::CommitResponse* response) {
  return commits_.receive(*context, response);
}

grpc::Status WorkerService::Fail(grpc::ServerContext*, const v1::FailRequest* request, v1::FailResponse*) {
  return guarded([&] {
    const LeaseKey key = from_proto(request->key());
    const WorkerId worker = keys_.worker_of(request->worker_id());
    const LogScope scope(log_context(worker, key));
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
    const LogScope scope(log_context(worker, key));
    std::vector<std::string> lines;
    for (const std::string& line : request->missing_light()) lines.push_back(one_line(line));
    farm_.warn(worker, key, lines);
    return grpc::Status::OK;
  });
}

grpc::Status WorkerService::ShowPicture(grpc::ServerContext*, const v1::ShowPictureRequest* request,
                                        v1::ShowPictureResponse*) {
  return guarded([&] {
    farm_.show(keys_.worker_of(request->worker_id()), from_proto(request->key()), picture_of(*request));
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

grpc::ServerWriteReactor<v1::FetchBlobsResponse>* WorkerService::FetchBlobs(
    grpc::CallbackServerContext* context, const v1::FetchBlobsRequest* request) {
  const auto open =
      [this, digests = std::vector<std::string>(request->digests().begin(), request->digests().end())] {
        if (digests.size() > kMaxAskedBlobs) throw Error(ErrorKind::kUsage, "more than 10000 blobs at once");
        return blobs_as_messages(blobs_, digests);
      };
  return new SendingCall<v1::FetchBlobsResponse>(*context, stalls_, fetches_, {fetch_pool_, fetch_pool_},
                                                 "workers fetch scene files at once", open);
}

}  // namespace lightmill
