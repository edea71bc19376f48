#include "coordinator/web/scene_submit.h"

#include <google/protobuf/util/json_util.h>

#include <nlohmann/json.hpp>

#include "common/rpc/status.h"
#include "coordinator/service/scenes/scene_request.h"

namespace lightmill {
namespace {

using nlohmann::json;

SceneJob scene_of(const std::string& body) {
  v1::SceneRequest request;
  const auto parsed = google::protobuf::util::JsonStringToMessage(body, &request);
  if (!parsed.ok())
    throw Error(ErrorKind::kUsage,
                "the body is not a scene's JSON: " + one_line(parsed.message().ToString()));
  return scene_job_of(request);
}

SceneDesk& desk_of(const WebOptions& web) {
  if (!web.scenes) throw Error(ErrorKind::kFailed, "this coordinator reads no scenes");
  return *web.scenes;
}

}  // namespace

json check_scene(const WebOptions& web, const std::string& body) {
  const SceneJob scene = scene_of(body);
  const SceneAnswer answer = desk_of(web).check(scene.question);
  const v1::CheckSceneResponse said = check_response(answer);
  auto missing = json::array();
  for (const v1::MissingFile& file : said.missing())
    missing.push_back({{"reference", file.reference()}, {"name", file.name()}});
  json view{{"errors", answer.errors}, {"warnings", answer.warnings}, {"missing", std::move(missing)}};
  if (!answer.errors.empty()) return view;
  view["files"] = said.files();
  view["bytes"] = said.bytes();
  view["width"] = said.width();
  view["height"] = said.height();
  if (said.has_spp()) view["spp"] = said.spp();
  view["max_depth"] = said.max_depth();
  return view;
}

JobId submit_scene(const WebOptions& web, const std::string& body, const std::string& user) {
  SceneJob scene = scene_of(body);
  scene.job.submitter = user;
  return desk_of(web)
      .submit(scene, [&] { return web.submissions ? web.submissions->refusal(user) : std::string(); })
      .job;
}

}  // namespace lightmill
