#pragma once
// A scene that a browser has uploaded file by file: what it still lacks, and the job that it becomes.
//
// A request's body is a v1::SceneRequest as JSON (proto/lightmill/v1/thin_client.proto).
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "coordinator/web/web_api.h"

namespace lightmill {

/// {"errors": […], "warnings": […], "missing": [{reference, name}…]}, the lines as lightmill check prints
/// them; without errors also "files" that the scene uses, "bytes" of them, and "width", "height", "spp",
/// "max_depth". Throws Error(kUsage) for a body that is wrong, LimitReached for quotas, Error(kFailed) for a
/// file that was not uploaded, and what SceneDesk::check throws.
nlohmann::json check_scene(const WebOptions& web, const std::string& body);

/// Submits it. Throws as check_scene, Error(kBadScene) with the scene's first error, and what
/// Farm::submit throws. `user` counts towards the submission quota.
JobId submit_scene(const WebOptions& web, const std::string& body, const std::string& user);

}  // namespace lightmill
