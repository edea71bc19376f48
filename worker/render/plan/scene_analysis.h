#pragma once
// Analyses a built scene into its plan.
#include "common/settings.h"
#include "worker/render/plan/scene_plan.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

ScenePlan analyse_scene(const SceneDescription& description, const RenderScene& scene,
                        const RenderSettings& settings);

}  // namespace lightmill
