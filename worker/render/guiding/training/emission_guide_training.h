#pragma once
// Trains the emission guide: which lights' paths matter, and where those of flat lamps and of lights at a
// point go.
//
// The brightest light may be behind a door. A lamp shines all around when what makes a caustic is one glass
// at the other end of the room. So light paths are followed (light_path_preview.h). The mean square of what
// they bring, by light tracing and by connections, is kept for every light, and for cells of the directions
// of flat lamps and of lights at a point. Light paths then choose lights and cells by its root, which is the
// density of least variance (Kahn and Marshall 1953). A part of them chooses lights by power, and goes
// anywhere.
#include "common/job/sampling_plan.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Gain (RenderScene::emission_guide_gain) from which on light paths use the guide unless a sampling plan
/// says whether they do. For a smaller gain a pilot decides. Fixed strategies have no pilot: there, light
/// paths start as the lights shine, which is more even, because a guide's cells are drawn at random.
inline constexpr double kEmissionGuidePays = 1.25;

/// Gives `scene` guided lights (guided_lights) if they may gain, of all noise, on samples other than those
/// that they were learnt from. A pilot decides whether that pays. `context` as for preview_light_paths(), of
/// the scene and the whole film.
void train_emission_guide(const StageContext& context, int threads, RenderScene* scene);

/// Whether light paths use the guide when `strategies` run under `plan`.
inline bool uses_emission_guide(const RenderScene& scene, const SamplingPlan& plan, Strategies strategies) {
  return scene.guided_lights && strategies & kLightPaths &&
         plan.guided_emission.value_or(scene.emission_guide_gain >= kEmissionGuidePays);
}

}  // namespace lightmill
