#pragma once
// What leaving a feature out saves, measured: the same packets rendered with and without it, in turn.
#include "common/scene/description.h"
#include "common/job/settings.h"

namespace lightmill {

/// Share of the CPU time of a render with `feature` switched on that the render under `settings` does
/// without; negative if that is faster. From a few packets, on the calling thread: about `seconds` of CPU
/// time. The scene is built anew. `settings` must have a plan if its integrator needs a pilot.
double measured_saving(const SceneDescription& scene, const RenderSettings& settings, Features feature,
                       double seconds);

}  // namespace lightmill
