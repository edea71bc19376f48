#pragma once
// Warps of the unit square, with their densities.
#include "worker/render/math/trig.h"
#include "worker/render/math/vec.h"

namespace lightmill {

/// Uniform on the unit disk (Shirley & Chiu 1997); density 1/pi per unit area.
template <class F>
inline void square_to_disk(F u, F v, F* x, F* y) {
  const F a = 2.0f * u - 1.0f, b = 2.0f * v - 1.0f;
  const MaskOf<F> wide = abs(a) > abs(b);
  const F r = select(wide, a, b);
  const F other = select(wide, b, a);
  const F ratio = select(MaskOf<F>(r == 0.0f), F{}, other / select(MaskOf<F>(r == 0.0f), splat<F>(1.0f), r));
  F s, c;
  sincos_quarter(ratio * (kPi / 4), &s, &c);
  *x = r * select(wide, c, s);
  *y = r * select(wide, s, c);
}

/// Cosine-weighted on the hemisphere z > 0; density z/pi per unit solid angle. z is bounded below so that a
/// sampled direction never has a zero density.
template <class F>
inline Vec3<F> square_to_cosine_hemisphere(F u, F v) {
  F x, y;
  square_to_disk(u, v, &x, &y);
  return {x, y, sqrt(max(1.0f - x * x - y * y, splat<F>(0x1p-24f)))};
}

/// Uniform on the unit sphere; density 1/(4 pi) per unit solid angle.
template <class F>
inline Vec3<F> square_to_sphere(F u, F v) {
  const F z = 1.0f - 2.0f * u;
  const F r = safe_sqrt(1.0f - z * z);
  F s, c;
  sincos_2pi(v, &s, &c);
  return {r * c, r * s, z};
}

/// Uniform barycentrics (b1, b2) on a triangle (Heitz 2019, low distortion); density 1/area.
template <class F>
inline void square_to_triangle(F u, F v, F* b1, F* b2) {
  const MaskOf<F> lower = u < v;
  const F p = select(lower, u * 0.5f, u - v * 0.5f);
  const F q = select(lower, v - u * 0.5f, v * 0.5f);
  *b1 = p;
  *b2 = q;
}

}  // namespace lightmill
