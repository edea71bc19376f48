#pragma once
// v1.ThinClientService: pieces of files, scenes that the coordinator reads, and pictures as files.
#include <memory>

#include "coordinator/core/farm.h"
#include "coordinator/service/caller.h"
#include "coordinator/service/limits/answer_memory.h"
#include "coordinator/service/limits/stall_watch.h"
#include "coordinator/service/limits/submit_limit.h"
#include "coordinator/service/scenes/scene_desk.h"
#include "coordinator/service/scenes/uploads.h"
#include "coordinator/service/streams/image_answers.h"
#include "coordinator/service/task_pool.h"
#include "lightmill/v1/thin_client.grpc.pb.h"

namespace lightmill {

/// Pictures are callbacks, so that no peer has a thread while it takes one; other calls have a thread each.
class ThinClientService final
    : public v1::ThinClientService::WithCallbackMethod_GetPicture<v1::ThinClientService::Service> {
 public:
  /// References must outlive the service. `submissions` bounds the submissions of all callers together; may
  /// be null. `caller` may be empty: then all callers are one.
  ThinClientService(Farm& farm, SceneDesk& scenes, Uploads& uploads, StallWatch& stalls,
                    std::shared_ptr<SubmitLimit> submissions, Caller caller = {});

  grpc::Status PutBlob(grpc::ServerContext*, const v1::PutBlobRequest*, v1::PutBlobResponse*) override;
  grpc::Status CheckScene(grpc::ServerContext*, const v1::SceneRequest*, v1::CheckSceneResponse*) override;
  grpc::Status SubmitScene(grpc::ServerContext*, const v1::SceneRequest*, v1::SubmitSceneResponse*) override;
  grpc::ServerWriteReactor<v1::FileChunk>* GetPicture(grpc::CallbackServerContext*,
                                                      const v1::GetPictureRequest*) override;

 private:
  std::string user(const grpc::ServerContext& context) const {
    return caller_ ? caller_(context) : std::string();
  }

  SceneDesk& scenes_;
  Uploads& uploads_;
  StallWatch& stalls_;
  const std::shared_ptr<SubmitLimit> submissions_;
  const Caller caller_;
  StallWatch::Group pictures_;
  AnswerMemory memory_, files_;  // of images that are resolved, and of files that are made of them
  ImageAnswers images_;
  TaskPool opening_, streaming_;  // ended first: their tasks use what is above
};

}  // namespace lightmill
