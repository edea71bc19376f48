#pragma once
// v1.WorkerService over a Farm and a BlobStore. It translates, bounds and streams; it decides nothing.
//
// Lease, Commit and FetchBlobs are many, so they are callbacks. gRPC's few threads receive and send. What may
// block (a worker that waits for work, a partial that is merged, a file that is read) goes to threads of our
// own. All other calls have a thread each while they last.
#include <atomic>

#include "coordinator/core/farm.h"
#include "coordinator/http/metrics.h"
#include "coordinator/service/caller.h"
#include "coordinator/service/limits/quotas.h"
#include "coordinator/service/limits/stall_watch.h"
#include "coordinator/service/streams/commits.h"
#include "coordinator/service/task_pool.h"
#include "coordinator/service/tile_log.h"
#include "coordinator/service/wanted_blobs.h"
#include "coordinator/service/worker_keys.h"
#include "coordinator/store/blob_store.h"
#include "lightmill/v1/worker.grpc.pb.h"

namespace lightmill {

class WorkerService final
    : public v1::WorkerService::WithCallbackMethod_Lease<v1::WorkerService::WithCallbackMethod_Commit<
          v1::WorkerService::WithCallbackMethod_FetchBlobs<v1::WorkerService::Service>>> {
 public:
  /// All references, and `wanted` unless it is null, must outlive the service.
  WorkerService(Farm& farm, BlobStore& blobs, Metrics& metrics, TileLog& tile_log, StallWatch& stalls,
                const Quotas& quotas, double lease_seconds, Caller caller = {},
                WantedBlobs* wanted = nullptr);
  /// Ends long polls soon with UNAVAILABLE.
  void stop() { stopping_ = true; }

  grpc::Status Register(grpc::ServerContext*, const v1::RegisterRequest*, v1::RegisterResponse*) override;
  grpc::ServerUnaryReactor* Lease(grpc::CallbackServerContext*, const v1::LeaseRequest*,
                                  v1::LeaseResponse*) override;
  grpc::Status Renew(grpc::ServerContext*, const v1::RenewRequest*, v1::RenewResponse*) override;
  grpc::ServerReadReactor<v1::CommitRequest>* Commit(grpc::CallbackServerContext*,
                                                     v1::CommitResponse*) override;
  grpc::Status Fail(grpc::ServerContext*, const v1::FailRequest*, v1::FailResponse*) override;
  grpc::Status Warn(grpc::ServerContext*, const v1::WarnRequest*, v1::WarnResponse*) override;
  grpc::Status ShowPicture(grpc::ServerContext*, const v1::ShowPictureRequest*,
                           v1::ShowPictureResponse*) override;
  grpc::Status Drain(grpc::ServerContext*, const v1::DrainRequest*, v1::DrainResponse*) override;
  grpc::Status GetBundle(grpc::ServerContext*, const v1::GetBundleRequest*, v1::GetBundleResponse*) override;
  grpc::ServerWriteReactor<v1::FetchBlobsResponse>* FetchBlobs(grpc::CallbackServerContext*,
                                                               const v1::FetchBlobsRequest*) override;
  grpc::Status HandInBlob(grpc::ServerContext*, grpc::ServerReader<v1::HandInBlobRequest>*,
                          v1::HandInBlobResponse*) override;

 private:
  /// Long poll.
  grpc::Status wait_for_lease(grpc::CallbackServerContext* context, const WorkerId& worker, double seconds,
                              v1::LeaseResponse* response);
  void grant(const WorkerId& worker, const LeaseGrant& grant, double waited, v1::LeaseResponse* response);

  Farm& farm_;
  BlobStore& blobs_;
  Metrics& metrics_;
  TileLog& tile_log_;
  StallWatch& stalls_;
  const double lease_seconds_;
  const Caller caller_;
  const WorkerKeys keys_;
  WantedBlobs* const wanted_;
  std::atomic<bool> stopping_{false};
  std::atomic<int> waiting_ = 0, waiting_strangers_ = 0, hand_ins_ = 0;
  Commits commits_;
  StallWatch::Group fetches_;
  TaskPool waiting_pool_, fetch_pool_;  // ended first: their tasks use what is above
};

}  // namespace lightmill
