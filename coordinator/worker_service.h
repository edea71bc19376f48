#pragma once
// v1.WorkerService over a Farm and a BlobStore: translates, bounds, streams; decides nothing.
#include <atomic>

#include "coordinator/blob_store.h"
#include "coordinator/farm.h"
#include "coordinator/metrics.h"
#include "coordinator/tile_log.h"
#include "lightmill/v1/worker.grpc.pb.h"

namespace lightmill {

class WorkerService final : public v1::WorkerService::Service {
 public:
  /// All must outlive the service.
  WorkerService(Farm& farm, BlobStore& blobs, Metrics& metrics, TileLog& tile_log, double lease_seconds)
      : farm_(farm), blobs_(blobs), metrics_(metrics), tile_log_(tile_log), lease_seconds_(lease_seconds) {}
  /// Ends long polls soon with UNAVAILABLE.
  void stop() { stopping_ = true; }

  grpc::Status Register(grpc::ServerContext*, const v1::RegisterRequest*, v1::RegisterResponse*) override;
  grpc::Status Lease(grpc::ServerContext*, const v1::LeaseRequest*, v1::LeaseResponse*) override;
  grpc::Status Renew(grpc::ServerContext*, const v1::RenewRequest*, v1::RenewResponse*) override;
  grpc::Status Commit(grpc::ServerContext*, grpc::ServerReader<v1::CommitRequest>*,
                      v1::CommitResponse*) override;
  grpc::Status Fail(grpc::ServerContext*, const v1::FailRequest*, v1::FailResponse*) override;
  grpc::Status Drain(grpc::ServerContext*, const v1::DrainRequest*, v1::DrainResponse*) override;
  grpc::Status GetBundle(grpc::ServerContext*, const v1::GetBundleRequest*, v1::GetBundleResponse*) override;
  grpc::Status FetchBlobs(grpc::ServerContext*, const v1::FetchBlobsRequest*,
                          grpc::ServerWriter<v1::FetchBlobsResponse>*) override;

 private:
  Farm& farm_;
  BlobStore& blobs_;
  Metrics& metrics_;
  TileLog& tile_log_;
  double lease_seconds_;
  std::atomic<bool> stopping_{false};
  std::atomic<int> waiting_ = 0;
  std::atomic<uint64_t> incoming_bytes_{0};  // of partials that are being received
};

}  // namespace lightmill
