#pragma once
// Stage 2 where surfaces stop a part of the rays (scene/geometry/alpha_mask.h): each surface that a path's
// segment meets is decided in order, by what is left of the number that chooses the direction at the next
// vertex. So whether a path is stopped, which part of a mix it meets and where it goes from there are one
// choice, stratified over the samples of a pixel: glass that is mostly let through by rays is as smooth as
// one that stops them all. Scenes without such surfaces never come here. Connections, walks in media and what
// a segment meets after PassedSurfaces::kMost surfaces are decided by hashes.
#include <cstdint>
#include <vector>

#include "worker/render/pipeline/context.h"

namespace lightmill {

struct AlphaWork {
  PassedSurfaces passed;
  alignas(
      32) float left[kWavefront];  // by slot: what is left of the number, a uniform; -1: nothing has used it
  std::vector<int32_t> undecided, met;
};

/// Casts the active paths, whose next vertex is at `depth`.
void cast_through_alpha(const StageContext& context, const LayerContext& layer, bool light, int depth,
                        KindsOfRays kinds, Wavefront& w);

}  // namespace lightmill
