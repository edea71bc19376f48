#pragma once
// lightmill render --diagnose DIR: where noise, time and fireflies come from, strategy by strategy.
#include <functional>
#include <string>

#include "common/job/settings.h"
#include "common/scene/description.h"

namespace lightmill::client {

/// Renders again while recording and writes into `folder` (made if absent): index.html, the image, and for
/// every strategy sS_tT_weighted and sS_tT_unweighted as .exr and .png. Throws Error(kFailed) if it can't be
/// written or `go_on` turned false, Error(kUsage) if there are too many pixels.
void write_diagnosis(const std::string& folder, const SceneDescription& scene, const RenderSettings& settings,
                     int threads, const std::function<bool()>& go_on);

}  // namespace lightmill::client
