#pragma once
// Photons for the caustic guide (guiding/photon_guide.h) and for manifold walks (guiding/manifold_seeds.h):
// light paths are followed as far as they meet nothing but mirrors and smooth glass; where they come to what
// can be joined then, they leave a photon. Two more paths by the same random numbers, which leave the same
// point of the light a little beside it, tell how the photon's direction changes with its place (ray
// differentials, Igehy 1999, by differences).
#include <algorithm>
#include <vector>

#include "common/base/parallel.h"
#include "worker/render/guiding/photon.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Events that a light path is followed through at most.
inline constexpr int kPhotonDepth = 12;

/// Where the kWavefront light paths from `number` kWavefront on, of a stream of paths of its own, come to
/// what can be joined, if mirrors and smooth glass led there: the vertices, of at most one a path.
std::vector<Vertex> arrivals_of_wavefront(const StageContext& context, size_t number);

/// What photons are for. A guide takes those of lights that camera paths can meet, on wide lobes; walks those
/// of lights that have points to walk to, with their events.
enum class PhotonUse { kGuide, kWalks };

/// Their photons.
std::vector<Photon> photons_of_wavefront(const StageContext& context, size_t number, PhotonUse use);

/// Appends `trace(number)` of wavefronts first, first + 1, ... up to `last` to `found`, in rounds of `round`,
/// until that has `enough`. On `threads` threads, of which no bit depends. Returns the first one that was not
/// traced.
template <class T, class Trace>
size_t trace_wavefronts(size_t first, size_t last, size_t round, size_t enough, int threads, Trace&& trace,
                        std::vector<T>* found) {
  while (first < last && found->size() < enough) {
    std::vector<std::vector<T>> parts(std::min(round, last - first));
    parallel_for(parts.size(), threads, [&](size_t i) { parts[i] = trace(first + i); });
    for (const std::vector<T>& part : parts) found->insert(found->end(), part.begin(), part.end());
    first += parts.size();
  }
  return first;
}

}  // namespace lightmill
