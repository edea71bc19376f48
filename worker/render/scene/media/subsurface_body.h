#pragma once
// Bodies that light walks through (walks/subsurface_walk.h), as the kernels read them: one per material.
#include "worker/render/math/vec.h"

namespace lightmill {

/// Slots of a body's record.
///   extinction  sigma_a + sigma_s per unit of normalised space, RGB
///   g           mean cosine of the phase function
///   leaves      probability that light which meets the boundary from inside leaves (bsdf/subsurface.h)
enum BodySlot { kBodyExtinction = 0, kBodyG = 3, kBodyLeaves = 4 };
inline constexpr int kBodyFloats = 8;
/// Where the parameters of a subsurface BSDF have the body's number.
inline constexpr int kBodyNumberSlot = 7;

/// One body per lane.
template <class F>
struct BodyRecord {
  const float* base;
  IntOf<F> offset;
  BodyRecord(const float* bodies, IntOf<F> body) : base(bodies), offset(body * kBodyFloats) {}
  F scalar(int slot) const { return gather(base + slot, offset); }
  Vec3<F> extinction() const {
    return {scalar(kBodyExtinction), scalar(kBodyExtinction + 1), scalar(kBodyExtinction + 2)};
  }
};

}  // namespace lightmill
