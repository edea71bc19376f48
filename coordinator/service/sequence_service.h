#pragma once
// v1.SequenceService over a Farm and a BlobStore. It translates, bounds and streams; it decides nothing.
#include <memory>

#include "coordinator/core/farm.h"
#include "coordinator/service/caller.h"
#include "coordinator/service/limits/quotas.h"
#include "coordinator/service/limits/stall_watch.h"
#include "coordinator/service/limits/submit_limit.h"
#include "coordinator/service/streams/watch_feed.h"
#include "coordinator/service/submissions.h"
#include "coordinator/store/blob_store.h"
#include "lightmill/v1/sequence.grpc.pb.h"

namespace lightmill {

class SequenceService final
    : public v1::SequenceService::WithCallbackMethod_WatchSequence<v1::SequenceService::Service> {
 public:
  /// As ClientService's; the gate is shared with it.
  SequenceService(Farm& farm, BlobStore& blobs, StallWatch& stalls, const Quotas& quotas,
                  SubmissionGate& gate, std::shared_ptr<SubmitLimit> submissions, Caller caller = {});
  /// Ends the streams of WatchSequence soon with UNAVAILABLE.
  void stop() { watches_.stop(); }

  grpc::Status SubmitSequence(grpc::ServerContext*, const v1::SubmitSequenceRequest*,
                              v1::SubmitSequenceResponse*) override;
  grpc::Status AddFrames(grpc::ServerContext*, const v1::AddFramesRequest*, v1::AddFramesResponse*) override;
  grpc::Status GetSequence(grpc::ServerContext*, const v1::GetSequenceRequest*,
                           v1::GetSequenceResponse*) override;
  grpc::Status ListSequences(grpc::ServerContext*, const v1::ListSequencesRequest*,
                             v1::ListSequencesResponse*) override;
  grpc::Status ListFrames(grpc::ServerContext*, const v1::ListFramesRequest*,
                          v1::ListFramesResponse*) override;
  grpc::ServerWriteReactor<v1::WatchSequenceResponse>* WatchSequence(
      grpc::CallbackServerContext*, const v1::WatchSequenceRequest*) override;
  grpc::Status PauseSequence(grpc::ServerContext*, const v1::PauseSequenceRequest*,
                             v1::PauseSequenceResponse*) override;
  grpc::Status ResumeSequence(grpc::ServerContext*, const v1::ResumeSequenceRequest*,
                              v1::ResumeSequenceResponse*) override;
  grpc::Status CancelSequence(grpc::ServerContext*, const v1::CancelSequenceRequest*,
                              v1::CancelSequenceResponse*) override;
  grpc::Status RetrySequence(grpc::ServerContext*, const v1::RetrySequenceRequest*,
                             v1::RetrySequenceResponse*) override;
  grpc::Status ExtendSequence(grpc::ServerContext*, const v1::ExtendSequenceRequest*,
                              v1::ExtendSequenceResponse*) override;
  grpc::Status SetSequencePriority(grpc::ServerContext*, const v1::SetSequencePriorityRequest*,
                                   v1::SetSequencePriorityResponse*) override;

 private:
  template <class Request>
  std::vector<FrameRequest> read_frames(const Request& request);
  /// Does it, and answers with the status that follows.
  template <class Request, class Response, class Action>
  grpc::Status change(const Request& request, Response* response, Action action);

  Farm& farm_;
  BlobStore& blobs_;
  const Quotas quotas_;
  SubmissionGate& gate_;
  const std::shared_ptr<SubmitLimit> submissions_;
  const Caller caller_;
  WatchFeed<v1::WatchSequenceResponse> watches_;
};

}  // namespace lightmill
