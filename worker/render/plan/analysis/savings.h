#pragma once
// Measures what leaving a feature out saves: the same packets are rendered with and without it, in turn.
#include "common/job/settings.h"
#include "common/scene/description.h"

namespace lightmill {

/// The part of a render's CPU time with `feature` switched on that the render under `settings` saves;
/// negative if leaving it out costs time. Measured on a few packets, on the calling thread, in about
/// `seconds` of CPU time. The scene is built anew. `settings` must have a plan if its integrator needs a
/// pilot.
double measured_saving(const SceneDescription& scene, const RenderSettings& settings, Features feature,
                       double seconds);

}  // namespace lightmill
