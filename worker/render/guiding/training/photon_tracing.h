#pragma once
// Traces photons for the photon guide (guiding/photon_guide.h) and for manifold walks
// (guiding/manifold_seeds.h). Light paths are followed as long as they meet mirrors and smooth glass only.
// Where they come to what can be joined then, they leave a photon. Two more paths by the same random numbers
// leave the same point of the light a little beside it. They tell how the photon's direction changes with its
// place (ray differentials, Igehy 1999, by differences).
#include <algorithm>
#include <vector>

#include "common/base/parallel.h"
#include "worker/render/guiding/photon.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Most events that a light path is followed through.
inline constexpr int kPhotonDepth = 12;

/// Follows the kWavefront light paths from `number` kWavefront on, of a stream of random numbers of their
/// own. Returns the vertices, at most one a path, where they come to what can be joined after mirrors and
/// smooth glass alone.
std::vector<Vertex> arrivals_of_wavefront(const StageContext& context, size_t number);

/// What photons are for. A guide takes those on wide lobes, of lights that camera paths can hit. Walks take
/// those of lights that have points to walk to, with their events.
enum class PhotonUse { kGuide, kWalks };

/// The photons of these paths.
std::vector<Photon> photons_of_wavefront(const StageContext& context, size_t number, PhotonUse use);

/// Appends `trace(number)` of the wavefronts first, first + 1, ... before `last` to `found`, in rounds of
/// `round`, until that has `enough`. The result is the same for any number of `threads`. Returns the first
/// wavefront that was not traced.
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
