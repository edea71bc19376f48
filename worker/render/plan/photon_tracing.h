#pragma once
// Photons for the caustic guide (light/caustic_guide.h): light paths are followed as far as they meet nothing
// but mirrors and smooth glass; where they come to a wide lobe then, they leave a photon. Two more paths by
// the same random numbers, which leave the same point of the light a little beside it, tell how the photon's
// direction changes with its place (ray differentials, Igehy 1999, by differences).
#include <vector>

#include "worker/render/light/caustic_guide.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Events that a light path is followed through at most.
inline constexpr int kPhotonDepth = 12;

/// Where the kWavefront light paths from `number` kWavefront on, of a stream of paths of its own, come to
/// what can be joined, if mirrors and smooth glass led there: the vertices, of at most one a path.
std::vector<Vertex> arrivals_of_wavefront(const StageContext& context, size_t number);

/// Their photons, of lights that camera paths can meet.
std::vector<Photon> photons_of_wavefront(const StageContext& context, size_t number);

}  // namespace lightmill
