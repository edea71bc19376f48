#include "coordinator/service/thin_client_service.h"

#include <chrono>

#include "coordinator/service/scenes/scene_request.h"
#include "coordinator/service/service_status.h"
#include "coordinator/service/streams/picture_files.h"
#include "coordinator/service/streams/sending_call.h"

namespace lightmill {
namespace {

constexpr size_t kMaxPictureCalls = 256;  // at once; beyond, the slowest peer makes room
constexpr uint64_t kPictureBytes = uint64_t{96} << 20;
constexpr size_t kPictureThreads = 4;

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

ThinClientService::ThinClientService(Farm& farm, SceneDesk& scenes, Uploads& uploads, StallWatch& stalls,
                                     std::shared_ptr<SubmitLimit> submissions, Caller caller)
    : scenes_(scenes),
      uploads_(uploads),
      stalls_(stalls),
      submissions_(std::move(submissions)),
      caller_(std::move(caller)),
      pictures_(stalls, kMaxPictureCalls),
      memory_(kPictureBytes, [this] { pictures_.cut_slowest(StallWatch::kSlowBytesPerSecond); }),
      files_(kPictureBytes, [this] { pictures_.cut_slowest(StallWatch::kSlowBytesPerSecond); }),
      images_(farm, memory_),
      opening_(kPictureThreads),
      streaming_(kPictureThreads) {}

grpc::Status ThinClientService::PutBlob(grpc::ServerContext* context, const v1::PutBlobRequest* request,
                                        v1::PutBlobResponse* response) {
  return guarded([&] {
    if (request->content().size() > Uploads::kPieceBytes)
      throw Error(ErrorKind::kUsage, "a piece of a file has more than 1 MiB; send it in smaller ones");
    const Uploads::Progress progress = uploads_.put(user(*context), request->digest(), request->size(),
                                                    request->offset(), request->content(), steady_seconds());
    response->set_received(progress.received);
    response->set_complete(progress.complete);
    return grpc::Status::OK;
  });
}

grpc::Status ThinClientService::CheckScene(grpc::ServerContext*, const v1::SceneRequest* request,
                                           v1::CheckSceneResponse* response) {
  return guarded([&] {
    *response = check_response(scenes_.check(scene_job_of(*request).question));
    return grpc::Status::OK;
  });
}

grpc::Status ThinClientService::SubmitScene(grpc::ServerContext* context, const v1::SceneRequest* request,
                                            v1::SubmitSceneResponse* response) {
  return guarded([&] {
    SceneJob scene = scene_job_of(*request);
    scene.job.submitter = user(*context);
    const SceneDesk::Submitted made =
        scenes_.submit(scene, [&] { return submissions_ ? submissions_->refusal("") : std::string(); });
    response->set_job_id(made.job.value);
    for (const std::string& line : made.warnings) response->add_warnings(one_line(line));
    return grpc::Status::OK;
  });
}

grpc::ServerWriteReactor<v1::FileChunk>* ThinClientService::GetPicture(grpc::CallbackServerContext* context,
                                                                       const v1::GetPictureRequest* request) {
  const auto open = [this, asked = *request] {
    const PictureForm form(asked);
    return picture_chunks(images_.get(form.image), form, files_);
  };
  return new SendingCall<v1::FileChunk>(*context, stalls_, pictures_, {opening_, streaming_},
                                        "pictures are being sent at once", open);
}

}  // namespace lightmill
