#pragma once
// v1.ClientService over a Farm and a BlobStore. It translates, bounds and streams; it decides nothing.
//
// Streams are callbacks: no peer has a thread while it is its turn. What may block (an image that is
// resolved, a file that is written) goes to pools. All other calls have a thread each while they last.
#include <atomic>
#include <functional>
#include <memory>

#include "coordinator/core/farm.h"
#include "coordinator/service/caller.h"
#include "coordinator/service/limits/answer_memory.h"
#include "coordinator/service/limits/quotas.h"
#include "coordinator/service/limits/stall_watch.h"
#include "coordinator/service/limits/submit_limit.h"
#include "coordinator/service/streams/image_answers.h"
#include "coordinator/service/streams/sending_call.h"
#include "coordinator/service/streams/watch_feed.h"
#include "coordinator/service/submissions.h"
#include "coordinator/service/task_pool.h"
#include "coordinator/service/tile_log.h"
#include "coordinator/store/blob_store.h"
#include "lightmill/v1/client.grpc.pb.h"

namespace lightmill {

class ClientService final
    : public v1::ClientService::WithCallbackMethod_ListTiles<v1::ClientService::WithCallbackMethod_WatchJob<
          v1::ClientService::WithCallbackMethod_FetchImage<v1::ClientService::WithCallbackMethod_GetLogs<
              v1::ClientService::WithCallbackMethod_UploadBlobs<v1::ClientService::Service>>>>> {
 public:
  /// Farm, blobs, log and stalls must outlive the service. `submissions` bounds the submissions of all
  /// callers together; may be null. `caller` may be empty: then submitters are taken for who they say they
  /// are.
  ClientService(Farm& farm, BlobStore& blobs, const TileLog& tile_log, StallWatch& stalls,
                const Quotas& quotas, SubmissionGate& gate, std::shared_ptr<SubmitLimit> submissions,
                Caller caller = {});
  /// Ends the streams of WatchJob soon with UNAVAILABLE.
  void stop() { watches_.stop(); }

  grpc::Status SubmitJob(grpc::ServerContext*, const v1::SubmitJobRequest*, v1::SubmitJobResponse*) override;
  grpc::Status GetJob(grpc::ServerContext*, const v1::GetJobRequest*, v1::GetJobResponse*) override;
  grpc::Status ListJobs(grpc::ServerContext*, const v1::ListJobsRequest*, v1::ListJobsResponse*) override;
  grpc::ServerWriteReactor<v1::ListTilesResponse>* ListTiles(grpc::CallbackServerContext*,
                                                             const v1::ListTilesRequest*) override;
  grpc::Status ListWorkers(grpc::ServerContext*, const v1::ListWorkersRequest*,
                           v1::ListWorkersResponse*) override;
  grpc::ServerWriteReactor<v1::WatchJobResponse>* WatchJob(grpc::CallbackServerContext*,
                                                           const v1::WatchJobRequest*) override;
  grpc::Status PauseJob(grpc::ServerContext*, const v1::PauseJobRequest*, v1::PauseJobResponse*) override;
  grpc::Status ResumeJob(grpc::ServerContext*, const v1::ResumeJobRequest*, v1::ResumeJobResponse*) override;
  grpc::Status CancelJob(grpc::ServerContext*, const v1::CancelJobRequest*, v1::CancelJobResponse*) override;
  grpc::Status RetryJob(grpc::ServerContext*, const v1::RetryJobRequest*, v1::RetryJobResponse*) override;
  grpc::Status SetJobPriority(grpc::ServerContext*, const v1::SetJobPriorityRequest*,
                              v1::SetJobPriorityResponse*) override;
  grpc::Status ExtendJob(grpc::ServerContext*, const v1::ExtendJobRequest*, v1::ExtendJobResponse*) override;
  grpc::ServerWriteReactor<v1::FetchImageResponse>* FetchImage(grpc::CallbackServerContext*,
                                                               const v1::FetchImageRequest*) override;
  grpc::Status GetCurve(grpc::ServerContext*, const v1::GetCurveRequest*, v1::GetCurveResponse*) override;
  grpc::ServerWriteReactor<v1::GetLogsResponse>* GetLogs(grpc::CallbackServerContext*,
                                                         const v1::GetLogsRequest*) override;
  grpc::Status FindMissingBlobs(grpc::ServerContext*, const v1::FindMissingBlobsRequest*,
                                v1::FindMissingBlobsResponse*) override;
  grpc::ServerReadReactor<v1::UploadBlobsRequest>* UploadBlobs(grpc::CallbackServerContext*,
                                                               v1::UploadBlobsResponse*) override;

 private:
  Image read_reference(const v1::Reference& reference, const RenderSettings& settings) const;
  template <class Response>
  grpc::ServerWriteReactor<Response>* send(grpc::CallbackServerContext* context,
                                           std::function<MessageSource<Response>()> open);
  Farm& farm_;
  BlobStore& blobs_;
  const TileLog& tile_log_;
  StallWatch& stalls_;
  const Quotas quotas_;
  SubmissionGate& gate_;
  const std::shared_ptr<SubmitLimit> submissions_;
  const Caller caller_;
  std::atomic<int> verifications_{0};
  StallWatch::Group answers_;
  AnswerMemory memory_;
  ImageAnswers images_;
  WatchFeed<v1::WatchJobResponse> watches_;
  StallWatch::Group uploads_;
  TaskPool opening_, streaming_;  // ended first: their tasks use what is above
};

}  // namespace lightmill
