#pragma once
// Which kernels the stages have for a scene (kernel_set.h).
#include <string>

#include "worker/render/pipeline/kernel_set.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// The least that `scene` can do with when its lights are `lights` (StageContext), but for what
/// --plan-override keeps.
StageKernels stage_kernels(const RenderScene& scene, const LightTable& lights);

/// Why paths need general kernels, or don't, for the plan.
std::string reason_of(const RenderScene& scene, const LightTable& lights, const StageKernels& kernels);

}  // namespace lightmill
