#pragma once
// Points of lamps that have an area, uniform by area, over a lane type.
#include "worker/render/light/lamp.h"

namespace lightmill {

template <class F>
struct EmitterPoint {
  Vec3<F> at, normal;
  F error{};     // bound of the position error per component
  F b1{}, b2{};  // of a triangle: barycentrics
};

/// A point of the triangle, sphere or flat lamp that is the light of `r`; undefined for other types.
/// `sphere_normal()` gives the point of a unit sphere to take, and is called if there are sphere lights.
template <class F, class SphereNormal>
inline EmitterPoint<F> emitter_point(const LightTable& lights, const LightRecord<F>& r, IntOf<F> type, F u,
                                     F v, SphereNormal&& sphere_normal) {
  constexpr float kRounding = 0x1p-21f;
  EmitterPoint<F> s;
  square_to_triangle(u, v, &s.b1, &s.b2);
  s.at = r.vec(kLightP) + r.vec(kLightE1) * s.b1 + r.vec(kLightE2) * s.b2;
  if (lights.any_flat_lamp) s.at = select(flat_lamps<F>(type), flat_lamp_point(r, type, u, v), s.at);
  s.normal = r.vec(kLightN);
  s.error = position_error(s.at, kRounding);
  if (lights.any_sphere) {
    const MaskOf<F> sphere = MaskOf<F>(type == kSphereLight);
    const Vec3<F> n = sphere_normal(), centre = r.vec(kLightP);
    const F radius = r.scalar(3);
    s.at = select(sphere, centre + n * radius, s.at);
    s.normal = select(sphere, n * r.scalar(kLightOrientation), s.normal);
    s.error = select(sphere, position_error(centre, kRounding) + radius * kRounding, s.error);
  }
  return s;
}

}  // namespace lightmill
