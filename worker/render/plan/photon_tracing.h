#pragma once
// Photons for the caustic guide (light/caustic_guide.h): light paths are followed as far as they meet nothing
// but mirrors and smooth glass; where they come to a wide lobe then, they leave a photon. Two more paths by
// the same random numbers, which leave the same point of the light a little beside it, tell how the photon's
// direction changes with its place (ray differentials, Igehy 1999, by differences).
#include <vector>

#include "worker/render/light/caustic_guide.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Those of the kWavefront light paths from `number` kWavefront on, of a stream of paths of its own.
std::vector<Photon> photons_of_wavefront(const StageContext& context, size_t number);

}  // namespace lightmill
