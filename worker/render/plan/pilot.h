#pragma once
// The pilot of the integrator `auto`: a few recorded samples with every strategy, from which the noise and
// cost of every sampling plan are predicted and the best one is chosen. A pure function of scene and settings
// (seed, film, depth): costs are counted work, not time, so the choice does not depend on the machine or its
// load.
#include <functional>

#include "common/job/pilot_report.h"
#include "worker/render/renderer.h"

namespace lightmill {

/// Runs the pilot of `renderer`'s scene and settings, whose plan is ignored, on `threads` threads (>= 1).
/// `go_on` is asked now and then, from any of them; once false, Error(kFailed) is thrown.
PilotReport run_pilot(const Renderer& renderer, int threads, const std::function<bool()>& go_on);

}  // namespace lightmill
