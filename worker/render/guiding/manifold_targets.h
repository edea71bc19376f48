#pragma once
// The points of lights that manifold walks lead to (walks/manifold_walk.h). They are drawn without regard to
// the point that asks, because what is between bends the light.
#include "worker/render/light/emitter_point.h"

namespace lightmill {

/// Whether a light has such points: all do but those that shine from all around.
inline bool has_targets(const LightTable& lights, int32_t light) {
  const auto i = static_cast<size_t>(light);
  if (lights.type[i] == kFacingLamp) return false;
  if (lights.type[i] != kInfiniteLight) return lights.pattern_of.empty() || lights.pattern_of[i] < 0;
  const float* r = &lights.records[i * kLightFloats];
  return r[4] == kSunCone && r[6] == 0;
}

template <class F>
struct LightTarget {
  Vec3<F> at, normal;  // a point and its normal, if any; or a unit direction to the light
  F error{};           // bound of the position error per component
  F inv_pdf{};         // per unit area, at infinity per unit solid angle; 1 for lights without extent
  MaskOf<F> infinite{};
};

/// Draws a target. `axis`: of the half of a spherical light to sample; 0: all of it.
template <class F>
inline LightTarget<F> sample_target(const LightTable& lights, IntOf<F> light, const Vec3<F>& axis, F u, F v) {
  const LightRecord<F> r(lights, light);
  const IntOf<F> type = gather(lights.type.data(), light);
  LightTarget<F> t;
  const MaskOf<F> half = MaskOf<F>(dot(axis, axis) > 0.0f);
  const EmitterPoint<F> p = emitter_point<F>(lights, r, type, u, v, [&] {
    const Vec3<F> n = square_to_sphere(u, v);
    return select(mask_and(half, MaskOf<F>(dot(n, axis) < 0.0f)), -n, n);
  });
  t.at = p.at;
  t.normal = p.normal;
  t.error = p.error;
  t.inv_pdf = select(mask_and(MaskOf<F>(type == kSphereLight), half), r.scalar(kLightArea) * 0.5f,
                     r.scalar(kLightArea));
  t.infinite = splat_mask<F>(false);
  if (lights.any_delta) {
    const MaskOf<F> point = mask_and(MaskOf<F>(type >= kPointLight), MaskOf<F>(type < kInfiniteLight));
    const MaskOf<F> distant = MaskOf<F>(type == kDistantLight);
    t.at = select(point, r.vec(kLightP), select(distant, -r.vec(kLightN), t.at));
    t.normal = select(point, Vec3<F>{}, t.normal);
    t.error = select(point, F{}, t.error);
    t.inv_pdf = select(mask_or(point, distant), splat<F>(1.0f), t.inv_pdf);
    t.infinite = distant;
  }
  if (lights.any_sun) {
    const MaskOf<F> sun = suns(r, MaskOf<F>(type == kInfiniteLight));
    t.at = select(sun, sample_sun(r, sun, u, v), t.at);
    t.inv_pdf = select(sun, (2 * kPi) * select(sun, r.scalar(5), F{}), t.inv_pdf);
    t.infinite = mask_or(t.infinite, sun);
  }
  return t;
}

/// Whether `at` could be a target of `light`.
template <class F>
inline MaskOf<F> is_target(const LightTable& lights, IntOf<F> light, const Vec3<F>& axis, const Vec3<F>& at) {
  const MaskOf<F> sphere = MaskOf<F>(gather(lights.type.data(), light) == kSphereLight);
  const Vec3<F> n = at - LightRecord<F>(lights, light).vec(kLightP);
  return mask_or(mask_not(sphere), MaskOf<F>(dot(n, axis) >= 0.0f));
}

/// What `light` sends from a target against the unit direction `d`: radiance times the cosine there; for
/// lights at a point intensity; for lights far away irradiance or radiance.
template <class F>
inline Vec3<F> target_light(const LightTable& lights, IntOf<F> light, const LightTarget<F>& t,
                            const Vec3<F>& d) {
  const LightRecord<F> r(lights, light);
  const IntOf<F> type = gather(lights.type.data(), light);
  Vec3<F> shines = r.vec(kLightRadiance);
  const MaskOf<F> area = MaskOf<F>(type <= kLastWithNormal);
  shines = select(area, emitted_radiance(lights, light, t.normal, -d) * abs(dot(t.normal, d)), shines);
  if (lights.any_spot) {
    const MaskOf<F> spot = MaskOf<F>(type == kSpotLight);
    shines = select(spot, shines * spot_falloff(r, one_minus_cos(-d, r.vec(kLightN))), shines);
  }
  for_each_image<F>(lights, r, type, [&](const auto& map, MaskOf<F> m) {
    shines = select(m, map.template towards<F>(-d), shines);
  });
  return shines;
}

}  // namespace lightmill
