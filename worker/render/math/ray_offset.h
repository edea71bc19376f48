#pragma once
// Ray origins that can't hit the surface that they leave: offsets by ULP-based error bounds, no epsilons
// (pbrt-v4 §6.8.6, after Ize 2013; bounds by standard error analysis, gamma_n = n u / (1 - n u)).
#include "worker/render/math/vec.h"

namespace lightmill {

/// gamma_n for float.
constexpr float gamma_bound(int n) {
  constexpr float u = 0x1p-24f;
  return static_cast<float>(n) * u / (1 - static_cast<float>(n) * u);
}

/// The next float away from zero in the direction of `sign` (x moves up if sign > 0, down if < 0).
template <class F>
inline F next_float(F x, F sign) {
  const MaskOf<F> up = sign > 0.0f;
  const MaskOf<F> positive = x > 0.0f;
  const MaskOf<F> zero = x == 0.0f;
  const UintOf<F> bits = float_bits(x);
  const MaskOf<F> away = MaskOf<F>(up == positive);
  const F moved = bits_float(select(away, bits + 1u, bits - 1u));
  const F tiny =
      select(up, splat<F>(0x1p-126f), splat<F>(-0x1p-126f));  // smallest normal: denormals are flushed
  return select(zero, tiny, moved);
}

/// Point `p` on a surface with unit geometric normal `n` whose position is known within `error` per
/// component, moved to the side of direction `w` so far that it is certainly off the surface.
template <class F>
inline Vec3<F> offset_origin(const Vec3<F>& p, F error, const Vec3<F>& n, const Vec3<F>& w) {
  F d = (abs(n.x) + abs(n.y) + abs(n.z)) * error;
  d = select(MaskOf<F>(dot(n, w) < 0.0f), -d, d);
  const Vec3<F> offset = n * d;
  const Vec3<F> q = p + offset;
  return {select(MaskOf<F>(offset.x != 0.0f), next_float(q.x, offset.x), q.x),
          select(MaskOf<F>(offset.y != 0.0f), next_float(q.y, offset.y), q.y),
          select(MaskOf<F>(offset.z != 0.0f), next_float(q.z, offset.z), q.z)};
}

}  // namespace lightmill
