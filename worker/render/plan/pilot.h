#pragma once
// The pilot of the integrator `auto`. It records a few samples with every strategy, predicts noise and cost
// of every sampling plan from them, and chooses the best. A pure function of scene and settings (seed, film,
// depth): costs are counted work, not time, so the choice does not depend on the machine or its load.
#include <cstdint>
#include <functional>
#include <optional>

#include "common/job/pilot_report.h"
#include "worker/render/renderer.h"

namespace lightmill {

/// Most camera paths of a pilot.
inline constexpr int64_t kMostPilotPaths = 3 << 16;

/// Camera paths of the pilot of these settings' job: small jobs are not to wait for what they would not gain.
int64_t pilot_paths(const RenderSettings& settings);

/// Runs the pilot of `renderer`'s scene and settings, whose plan is ignored, on `threads` threads (>= 1).
/// `go_on` is called now and then, from any of them. Once it returns false, Error(kFailed) is thrown.
/// `paths`: pilot_paths() of the settings by default.
PilotReport run_pilot(const Renderer& renderer, int threads, const std::function<bool()>& go_on,
                      std::optional<int64_t> paths = {});

}  // namespace lightmill
