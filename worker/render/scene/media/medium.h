#pragma once
// Participating media as the kernels read them. Where they vary: volume_table.h.
//
// A medium is its number in RenderScene::media; 0 is empty space. The media on both sides of something are
// one integer, its *sides*: the medium inside in bits 0-14, the one outside in bits 15-29. A primitive's
// sides also have two flags.
#include <cstdint>

#include "worker/render/math/vec.h"

namespace lightmill {

/// Slots of a medium's record; coefficients per unit of normalised space, in RGB.
///   extinction   sigma_a + sigma_s
///   scattering   sigma_s
///   collision    the rate at which paths are made to end a segment: the extinction, or 0 in a medium that
///                neither scatters nor glows, which they cross without a random number
///   mean_rate    mean of `collision` over the channels
///   g            mean cosine of the phase function
///   emission     Le sigma_a: radiance per unit length
///   grid         0, or 1 + the number of its grid (an integer by bits), by whose values the coefficients are
///                multiplied, or in whose place those stand
///   collides     1 if paths may end a segment in it, else 0
enum MediumSlot {
  kMediumExtinction = 0,
  kMediumScattering = 3,
  kMediumCollision = 6,
  kMediumMeanRate = 9,
  kMediumG = 10,
  kMediumEmission = 11,
  kMediumGrid = 14,
  kMediumCollides = 15
};
inline constexpr int kMediumFloats = 16;

inline constexpr int kMediumBits = 15;
inline constexpr int32_t kMaxMedia = (1 << kMediumBits) - 1;
/// Flag of a primitive's sides: what passes changes to the medium on the other side. Without it the medium
/// stays.
inline constexpr int32_t kMediumTransition = 1 << 30;
/// Flag of a primitive's sides: there is no surface, or a pane, and rays pass straight on. It is the sign, so
/// the test is sides < 0.
inline constexpr int32_t kMediumBoundary = INT32_MIN;

constexpr int32_t medium_sides(int32_t inside, int32_t outside) { return inside | outside << kMediumBits; }

/// The medium on one side of a primitive, vertex or light with these sides.
template <class F>
inline IntOf<F> medium_on_side(IntOf<F> sides, MaskOf<F> outside) {
  return select(outside, sides >> kMediumBits, sides) & kMaxMedia;
}

/// Sides of a primitive that is met from `medium`: the same medium on both unless it is a transition.
template <class F>
inline IntOf<F> sides_met(IntOf<F> sides, IntOf<F> medium) {
  const MaskOf<F> changes = MaskOf<F>((sides & kMediumTransition) != 0);
  return select(changes, sides & (kMediumTransition - 1), medium | (medium << kMediumBits));
}

/// One medium per lane.
template <class F>
struct MediumRecord {
  const float* base;
  IntOf<F> offset;
  MediumRecord(const float* media, IntOf<F> medium) : base(media), offset(medium * kMediumFloats) {}
  F scalar(int slot) const { return gather(base + slot, offset); }
  IntOf<F> grid() const { return as_int(float_bits(scalar(kMediumGrid))); }
  /// The coefficient of the channel `which` per lane.
  F channel(int slot, IntOf<F> which) const { return gather(base + slot, offset + which); }
  Vec3<F> rgb(int slot) const { return {scalar(slot), scalar(slot + 1), scalar(slot + 2)}; }
};

}  // namespace lightmill
