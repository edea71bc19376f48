#pragma once
// Chooses the kernels (kernel_set.h) that the stages run for a scene.
#include <string>

#include "worker/render/pipeline/kernel_set.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// The least kernels that `scene` can do with when its lights are `lights` (StageContext). --plan-override
/// may ask for more.
StageKernels stage_kernels(const RenderScene& scene, const LightTable& lights);

/// Why paths need general kernels, or don't: for the scene plan.
std::string reason_of(const RenderScene& scene, const LightTable& lights, const StageKernels& kernels);

}  // namespace lightmill
