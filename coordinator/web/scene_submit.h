#pragma once
// A scene that a browser has uploaded file by file: what it still lacks, and the job that it becomes.
//
// A request's body is a JSON object:
//   main, files: [{name, digest, size}…]    names relative to the scene file's folder
//   camera, environment, strict             as the options of lightmill submit
//   integrator, spp, time_seconds, target_error, max_depth (0: unlimited), seed, width, height, aovs
//   name, priority, pool, max_workers       of the job
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "coordinator/web/web_api.h"

namespace lightmill {

/// {"errors": […], "warnings": […], "missing": [{reference, name}…]}, the lines as lightmill check prints
/// them; without errors also "files" that the scene uses, "bytes" of them, and "width", "height", "spp",
/// "max_depth". Throws Error(kUsage) for a body that is wrong, LimitReached for quotas, Error(kFailed) for a
/// file that was not uploaded, and what WebOptions::read_scene throws.
nlohmann::json check_scene(const WebOptions& web, const std::string& body);

/// Submits it. Throws as check_scene, Error(kBadScene) with the scene's first error, and what
/// Farm::submit throws. `user` counts towards the submission quota.
JobId submit_scene(const WebOptions& web, const std::string& body, const std::string& user);

}  // namespace lightmill
