#pragma once
// A call of UploadBlobs, without a thread of its own: a peer that takes its time costs a file that is begun.
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <optional>

#include "coordinator/service/limits/quotas.h"
#include "coordinator/service/limits/stall_watch.h"
#include "coordinator/service/task_pool.h"
#include "coordinator/store/blob_store.h"
#include "lightmill/v1/client.pb.h"

namespace lightmill {

/// Deletes itself once the call has ended.
class UploadCall final : public grpc::ServerReadReactor<v1::UploadBlobsRequest> {
 public:
  /// References must outlive the call.
  UploadCall(grpc::CallbackServerContext& context, StallWatch& stalls, StallWatch::Group& group,
             TaskPool& pool, BlobStore& blobs, const Quotas& quotas, v1::UploadBlobsResponse* response);
  void OnReadDone(bool ok) override;
  void OnDone() override { delete this; }

 private:
  void read();
  /// Writes what has arrived. Throws Error.
  void take();
  void finish_blob();

  TaskPool& pool_;
  BlobStore& blobs_;
  const Quotas& quotas_;
  v1::UploadBlobsResponse* const response_;
  v1::UploadBlobsRequest message_;
  std::optional<BlobStore::Writer> writer_;
  int64_t blobs_begun_ = 0;
  uint64_t bytes_ = 0;
  StallWatch::Call call_;
};

}  // namespace lightmill
