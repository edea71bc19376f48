#pragma once
// Equal-area octahedral mapping between the unit square and the unit sphere (Clarberg, "Fast Equal-Area
// Mapping of the (Hemi)Sphere using SIMD", 2008; the orientation is pbrt-v4's). The square's area 1 covers
// 4 pi steradians everywhere alike, so densities convert by that constant.
#include "worker/render/math/angle.h"
#include "worker/render/math/vec.h"

namespace lightmill {

/// Unit direction of square point (s, t) in [0, 1]^2.
template <class F>
inline Vec3<F> equal_area_square_to_sphere(F s, F t) {
  const F u = 2.0f * s - 1.0f, v = 2.0f * t - 1.0f;
  const F up = abs(u), vp = abs(v);
  const F signed_distance = 1.0f - (up + vp);
  const F r = 1.0f - abs(signed_distance);
  const MaskOf<F> pole = MaskOf<F>(r == 0.0f);
  const F phi = (select(pole, F{}, (vp - up) / select(pole, splat<F>(1.0f), r)) + 1.0f) * (kPi / 4);
  // phi in [0, pi/2]: sin and cos of phi - pi/4 lie in the polynomial's range, then rotate by pi/4.
  F sn, cn;
  sincos_quarter(phi - kPi / 4, &sn, &cn);
  constexpr float kHalfRoot = 0.70710678118654752f;
  const F c = (cn - sn) * kHalfRoot, d = (cn + sn) * kHalfRoot;
  const F q = r * safe_sqrt(2.0f - r * r);
  return {copysign(max(c, F{}), u) * q, copysign(max(d, F{}), v) * q,
          copysign(1.0f - r * r, signed_distance)};
}

/// Square point of unit direction `w`; clamped to [0, 1].
template <class F>
inline void equal_area_sphere_to_square(const Vec3<F>& w, F* s, F* t) {
  const F x = abs(w.x), y = abs(w.y), z = min(abs(w.z), splat<F>(1.0f));
  const F r = sqrt((x * x + y * y) / (1.0f + z));  // sqrt(1 - z) without its cancellation near the poles
  const F a = max(x, y), b = min(x, y);
  const MaskOf<F> zero = MaskOf<F>(a == 0.0f);
  F phi = atan_unit(select(zero, F{}, b / select(zero, splat<F>(1.0f), a))) * (2.0f / kPi);
  phi = select(MaskOf<F>(x < y), 1.0f - phi, phi);
  F v = phi * r, u = r - v;
  const MaskOf<F> lower = MaskOf<F>(w.z < 0.0f);
  const F u0 = u;
  u = select(lower, 1.0f - v, u);
  v = select(lower, 1.0f - u0, v);
  *s = clamp((copysign(u, w.x) + 1.0f) * 0.5f, 0.0f, 1.0f);
  *t = clamp((copysign(v, w.y) + 1.0f) * 0.5f, 0.0f, 1.0f);
}

}  // namespace lightmill
