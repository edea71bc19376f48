#pragma once
// v1.ClientService over a Farm and a BlobStore. It translates, bounds and streams; it decides nothing.
#include <atomic>
#include <memory>
#include <semaphore>

#include "coordinator/core/farm.h"
#include "coordinator/service/caller.h"
#include "coordinator/service/quotas.h"
#include "coordinator/service/stall_watch.h"
#include "coordinator/service/submit_limit.h"
#include "coordinator/service/tile_log.h"
#include "coordinator/store/blob_store.h"
#include "lightmill/v1/client.grpc.pb.h"

namespace lightmill {

class ClientService final : public v1::ClientService::Service {
 public:
  /// Farm, blobs, log and stalls must outlive the service. `submissions` bounds the submissions of all
  /// callers together; may be null. `caller` may be empty: then submitters are taken for who they say they
  /// are.
  ClientService(Farm& farm, BlobStore& blobs, const TileLog& tile_log, StallWatch& stalls,
                const Quotas& quotas, std::shared_ptr<SubmitLimit> submissions, Caller caller = {})
      : farm_(farm),
        blobs_(blobs),
        tile_log_(tile_log),
        stalls_(stalls),
        quotas_(quotas),
        submissions_(std::move(submissions)),
        caller_(std::move(caller)) {}
  /// Ends the streams of WatchJob soon with UNAVAILABLE.
  void stop() { stopping_ = true; }

  grpc::Status SubmitJob(grpc::ServerContext*, const v1::SubmitJobRequest*, v1::SubmitJobResponse*) override;
  grpc::Status GetJob(grpc::ServerContext*, const v1::GetJobRequest*, v1::GetJobResponse*) override;
  grpc::Status ListJobs(grpc::ServerContext*, const v1::ListJobsRequest*, v1::ListJobsResponse*) override;
  grpc::Status ListTiles(grpc::ServerContext*, const v1::ListTilesRequest*,
                         grpc::ServerWriter<v1::ListTilesResponse>*) override;
  grpc::Status ListWorkers(grpc::ServerContext*, const v1::ListWorkersRequest*,
                           v1::ListWorkersResponse*) override;
  grpc::Status WatchJob(grpc::ServerContext*, const v1::WatchJobRequest*,
                        grpc::ServerWriter<v1::WatchJobResponse>*) override;
  grpc::Status PauseJob(grpc::ServerContext*, const v1::PauseJobRequest*, v1::PauseJobResponse*) override;
  grpc::Status ResumeJob(grpc::ServerContext*, const v1::ResumeJobRequest*, v1::ResumeJobResponse*) override;
  grpc::Status CancelJob(grpc::ServerContext*, const v1::CancelJobRequest*, v1::CancelJobResponse*) override;
  grpc::Status RetryJob(grpc::ServerContext*, const v1::RetryJobRequest*, v1::RetryJobResponse*) override;
  grpc::Status ExtendJob(grpc::ServerContext*, const v1::ExtendJobRequest*, v1::ExtendJobResponse*) override;
  grpc::Status FetchImage(grpc::ServerContext*, const v1::FetchImageRequest*,
                          grpc::ServerWriter<v1::FetchImageResponse>*) override;
  grpc::Status GetCurve(grpc::ServerContext*, const v1::GetCurveRequest*, v1::GetCurveResponse*) override;
  grpc::Status GetLogs(grpc::ServerContext*, const v1::GetLogsRequest*,
                       grpc::ServerWriter<v1::GetLogsResponse>*) override;
  grpc::Status FindMissingBlobs(grpc::ServerContext*, const v1::FindMissingBlobsRequest*,
                                v1::FindMissingBlobsResponse*) override;
  grpc::Status UploadBlobs(grpc::ServerContext*, grpc::ServerReader<v1::UploadBlobsRequest>*,
                           v1::UploadBlobsResponse*) override;

 private:
  Image read_reference(const v1::Reference& reference, const RenderSettings& settings) const;
  Farm& farm_;
  BlobStore& blobs_;
  const TileLog& tile_log_;
  StallWatch& stalls_;
  const Quotas quotas_;
  const std::shared_ptr<SubmitLimit> submissions_;
  const Caller caller_;
  std::atomic<bool> stopping_{false};
  std::counting_semaphore<> large_submissions_{2};  // that are unpacked at once
  std::atomic<int> fetches_{0}, watches_{0}, uploads_{0}, listings_{0}, verifications_{0};
};

}  // namespace lightmill
