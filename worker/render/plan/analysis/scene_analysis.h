#pragma once
// Analyses a built scene: what it needs and what is left out (scene_plan.h).
#include "common/job/settings.h"
#include "worker/render/camera/camera.h"
#include "worker/render/guiding/training/missing_light.h"
#include "worker/render/plan/analysis/radiance_scale.h"
#include "worker/render/plan/analysis/scene_plan.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// `possible`: the strategies that the scene allows, of which `strategies` run. `radiance`: of the
/// sums. `missing`: light that no path brings into images of the scene.
ScenePlan analyse_scene(const RenderScene& scene, const Camera& camera, const RadianceScale& radiance,
                        const MissingLight& missing, const RenderSettings& settings, Strategies possible,
                        Strategies strategies);

}  // namespace lightmill
