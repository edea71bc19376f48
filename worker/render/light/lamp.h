#pragma once
// Lamps: lights with an area and without a surface, as Cycles has them. Paths go through them, and count the
// light of those that they meet on their way (pipeline/connections/lamp_hits.h); no ray is stopped.
//
// Flat lamps, rectangles and ellipses, shine from one side. With a spread of half angle h < 90 degrees the
// radiance falls with the angle a to the normal as 1 - tan(a) / tan(h).
//
// A facing lamp is a disk around a point that faces whoever looks at it (Cycles' point and spot lamps with a
// radius R). A point at distance d sees it in the cone around the centre whose half angle is atan(R / d), of
// even radiance, or for a spot by the direction alone. So each straight line carries one radiance, but for
// the points next to the lamp that have the line outside of their cone. What a lamp is for MIS is therefore
// what a light at infinity is: directions have densities per unit solid angle, and lines densities per unit
// solid angle and unit area across them. A light path starts on the disk across its direction.
#include "worker/render/light/light_record.h"

namespace lightmill {

constexpr bool is_flat_lamp(LightType type) { return type == kRectangleLamp || type == kEllipseLamp; }
template <class F>
inline MaskOf<F> flat_lamps(IntOf<F> type) {
  return mask_or(MaskOf<F>(type == kRectangleLamp), MaskOf<F>(type == kEllipseLamp));
}

/// A point of a flat lamp, uniform by area.
template <class F>
inline Vec3<F> flat_lamp_point(const LightRecord<F>& r, IntOf<F> type, F u, F v) {
  F x, y;
  square_to_disk(u, v, &x, &y);
  const MaskOf<F> ellipse = MaskOf<F>(type == kEllipseLamp);
  x = select(ellipse, x, 2.0f * u - 1.0f);
  y = select(ellipse, y, 2.0f * v - 1.0f);
  return r.vec(kLightP) + r.vec(kLightE1) * x + r.vec(kLightE2) * y;
}

/// 1 - cos of the half angle under which facing lamps are seen from distance^2 d2.
template <class F>
inline F one_minus_cos_facing(F radius, F d2) {
  const F r2 = radius * radius, edge = sqrt(d2 + r2);
  return r2 / (edge * (edge + sqrt(d2)));
}

/// A facing lamp as `reference` sees it.
template <class F>
struct FacingCone {
  Vec3<F> axis;       // unit, to the centre
  F distance, width;  // to the centre; 1 - cos of the half angle

  FacingCone(const LightRecord<F>& r, MaskOf<F> facing, const Vec3<F>& reference) {
    const Vec3<F> to = r.vec(kLightP) - reference;
    const F d2 = dot(to, to);
    const MaskOf<F> apart = mask_and(facing, MaskOf<F>(d2 > 0.0f));
    distance = sqrt(select(apart, d2, splat<F>(1.0f)));
    axis = select(apart, to * (1.0f / distance), splat3<F>(0, 0, 1));
    width = one_minus_cos_facing(select(apart, r.scalar(3), splat<F>(1.0f)), distance * distance);
    width = select(apart, width, F{});
  }
  /// Whether unit direction `w` is in the cone. `margin`: of 1 - cos, for directions that come back rounded.
  MaskOf<F> holds(const Vec3<F>& w, float margin) const {
    return MaskOf<F>(one_minus_cos(axis, w) <= width * (1.0f + margin));
  }
  F pdf() const { return 1.0f / ((2 * kPi) * max(width, splat<F>(1e-30f))); }
  Vec3<F> sample(F u, F v) const {
    const F q = u * width, sine = safe_sqrt(q * (2.0f - q));
    F sp, cp;
    sincos_2pi(v, &sp, &cp);
    return Frame<F>(axis).to_world({sine * cp, sine * sp, 1.0f - q});
  }
};

/// Rounding of 1 - cos that a direction in the cone may come back with, over the cone's own.
inline constexpr float kConeRounding = 0x1p-10f;

/// Radiance of facing lamps along unit direction `w`, which they shine in.
template <class F>
inline Vec3<F> facing_radiance(const LightRecord<F>& r, const Vec3<F>& w) {
  const MaskOf<F> spot = MaskOf<F>(r.scalar(5) > 0.0f);
  const F falloff = spot_falloff(r, one_minus_cos(w, r.vec(kLightN)));
  return select(spot, r.vec(kLightRadiance) * falloff, r.vec(kLightRadiance));
}

/// The lanes where facing lamps shine on `p` along unit direction `wo` from there: all others, too.
template <class F, bool kAnyLight = true>
inline MaskOf<F> in_facing_cones(const LightTable& lights, IntOf<F> light, const Vec3<F>& p,
                                 const Vec3<F>& wo, F time) {
  MaskOf<F> lit = splat_mask<F>(true);
  if (!kAnyLight || !lights.any_facing) return lit;
  LightRecord<F> r(lights, light);
  r.move_to(lights, light, time);
  const MaskOf<F> facing = MaskOf<F>(gather(lights.type.data(), light) == kFacingLamp);
  if (!any(facing)) return lit;
  return mask_or(mask_not(facing), FacingCone<F>(r, facing, p).holds(wo, kConeRounding));
}

/// Where a ray meets a lamp.
template <class F>
struct LampHit {
  MaskOf<F> met;
  F distance{}, cos_light = splat<F>(1.0f);
  Vec3<F> radiance;
};

/// Where rays from `o` in unit direction `d` meet the lamp of `r`, the same in all lanes.
template <class F>
inline LampHit<F> meet_lamp(const LightRecord<F>& r, LightType type, const Vec3<F>& o, const Vec3<F>& d) {
  LampHit<F> hit;
  if (type == kFacingLamp) {
    const FacingCone<F> cone(r, splat_mask<F>(true), o);
    hit.distance = cone.distance * dot(cone.axis, d);
    hit.met = mask_and(cone.holds(d, 0), MaskOf<F>(hit.distance > 0.0f));
    hit.radiance = facing_radiance(r, -d);
    return hit;
  }
  const Vec3<F> n = r.vec(kLightN), e1 = r.vec(kLightE1), e2 = r.vec(kLightE2);
  const Vec3<F> to = r.vec(kLightP) - o;
  const F towards = -dot(d, n);
  const MaskOf<F> front = MaskOf<F>(towards > 0.0f);
  hit.cos_light = select(front, towards, splat<F>(1.0f));
  hit.distance = -dot(to, n) / hit.cos_light;
  const Vec3<F> at = d * hit.distance - to;
  // Coordinates along the edges, which a transform may have sheared.
  const F g11 = dot(e1, e1), g12 = dot(e1, e2), g22 = dot(e2, e2), a1 = dot(at, e1), a2 = dot(at, e2);
  const F inv = 1.0f / (g11 * g22 - g12 * g12);
  const F x = (a1 * g22 - a2 * g12) * inv, y = (a2 * g11 - a1 * g12) * inv;
  const MaskOf<F> inside =
      type == kEllipseLamp ? MaskOf<F>(x * x + y * y <= 1.0f) : MaskOf<F>(max(abs(x), abs(y)) <= 1.0f);
  hit.met = mask_and(mask_and(front, inside), MaskOf<F>(hit.distance > 0.0f));
  hit.radiance = r.vec(kLightRadiance) * lamp_spread(r, hit.cos_light);
  return hit;
}

}  // namespace lightmill
