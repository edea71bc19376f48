#pragma once
// Analyses a built scene into its plan.
#include "common/job/settings.h"
#include "worker/render/camera/camera.h"
#include "worker/render/plan/analysis/scene_plan.h"
#include "worker/render/guiding/training/missing_light.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// `possible`: strategies that the scene allows, of which `strategies` run. `imaging_ratio` multiplies every
/// contribution; `unmet` is what images of the scene lack.
ScenePlan analyse_scene(const RenderScene& scene, const Camera& camera, double imaging_ratio,
                        const MissingLight& missing, const RenderSettings& settings, Strategies possible,
                        Strategies strategies);

}  // namespace lightmill
