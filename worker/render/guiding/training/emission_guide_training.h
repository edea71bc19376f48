#pragma once
// Learns which lights' paths matter and where those of flat lamps and of lights at a point are to go.
//
// The brightest light may be behind a door, and a lamp shines all around when what makes a caustic is one
// glass at the other end of the room. Light paths are followed (light_path_preview.h) and the mean square of
// what comes of them, at the lens and by connections, is kept for every light and for cells of the directions
// of flat lamps and of lights at a point. Light paths then choose lights and cells by its root, which is the
// density of least variance (Kahn and Marshall 1953), and a part of them by power, and anywhere.
#include "common/job/sampling_plan.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Gain (RenderScene::emission_guide_gain) from which on light paths go by their aims unless a sampling plan says
/// whether they do. Of less a pilot says it; under fixed strategies, which have no pilot, they go as the
/// lights shine, more evenly: by aims, cells are drawn at random.
inline constexpr double kEmissionGuidePays = 1.25;

/// Gives `scene` lights that do so (guided_lights) where it may gain, of all noise, on samples other than
/// those that it was learnt from: whether it pays is for a pilot to say. `context` as for
/// preview_light_paths(), of the scene and the whole film.
void train_emission_guide(const StageContext& context, int threads, RenderScene* scene);

/// Whether light paths go by aims when `strategies` run under `plan`.
inline bool uses_emission_guide(const RenderScene& scene, const SamplingPlan& plan, Strategies strategies) {
  return scene.guided_lights && strategies & kLightPaths && plan.guided_emission.value_or(scene.emission_guide_gain >= kEmissionGuidePays);
}

}  // namespace lightmill
