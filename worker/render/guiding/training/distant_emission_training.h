#pragma once
// Where light paths of lights at infinity start, by what next_event_guide_training.h found out: most of a
// disk across the scene may be roof.
#include <vector>

#include "worker/render/guiding/training/next_event_probes.h"

namespace lightmill {

/// Gives distant lights emission cells, where less than half of their disk leads to places that were seen. A
/// part of their light paths still starts anywhere on the disk.
void train_distant_emission(const std::vector<LitPlace>& places, const std::vector<NextEventProbe>& trials,
                            LightTable* lights);

/// Divides the light paths of lights at infinity among these lights by the irradiance that places get from
/// each. The lights need a guide that chooses.
void share_far_paths(const NextEventProbes& rays, const std::vector<NextEventProbe>& trials,
                     const std::vector<int32_t>& sky_light, LightTable* lights);

}  // namespace lightmill
