#pragma once
// Sampling of lights in both directions, over a lane type.
//
// direct:   from a reference point towards a light; densities per unit solid angle at the reference point.
// emission: a ray that leaves a light; density per unit area x unit solid angle.
// All densities include the probability of selecting the light. A point or spot light's direct density is
// distance^2 x selection, so that radiance / pdf = I / (d^2 p); a distant light's is the selection alone.
#include "worker/render/light/light_table.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

template <class F>
struct DirectSample {
  Vec3<F> point;     // on the light (for infinite lights: not used)
  Vec3<F> normal;    // there
  Vec3<F> wi;        // unit, from the reference point
  F distance2{};     // squared distance to `point`
  Vec3<F> radiance;  // towards the reference point; 0 on the dark side
  F pdf{};           // direct density
  F pdf_emission{};  // density of emission sampling producing the reversed ray
  F cos_light{};     // |cos| at the light (1 for all but area lights)
  F error{};         // bound of the position error of `point` per component
  MaskOf<F> delta{};
  MaskOf<F> infinite{};  // infinite or distant
};

template <class F>
struct EmissionSample {
  Vec3<F> point, normal, direction;
  Vec3<F> power;  // radiance x cos / pdf: the path's initial throughput
  F pdf{};        // emission density
  F cos_light{};
  F error{};
  IntOf<F> light{};
  MaskOf<F> delta{}, infinite{};
};

/// Alias-method selection from one uniform.
template <class F>
inline IntOf<F> select_light(const LightTable& lights, F u) {
  if (lights.count() == 1) return IntOf<F>{};
  const F scaled = u * static_cast<float>(lights.count());
  const IntOf<F> column0 = to_int(scaled);
  const IntOf<F> last = splat_int<F>(lights.count() - 1);
  const IntOf<F> column = select(MaskOf<F>(column0 > last), last, column0);
  const F fraction = scaled - to_float(column);
  const MaskOf<F> keep = MaskOf<F>(fraction < gather(lights.alias_keep.data(), column));
  return select(keep, column, gather(lights.alias.data(), column));
}

template <class F>
struct LightRecord {
  const float* base;
  IntOf<F> offset;
  LightRecord(const LightTable& lights, IntOf<F> index)
      : base(lights.records.data()), offset(index * kLightFloats) {}
  F scalar(int slot) const { return gather(base + slot, offset); }
  Vec3<F> vec(int slot) const { return {scalar(slot), scalar(slot + 1), scalar(slot + 2)}; }
};

/// 1 - cos of the half angle under which a sphere is seen from distance^2 d2, without cancellation.
template <class F>
inline F one_minus_cos_cone(F radius, F d2) {
  const F s2 = min(radius * radius / d2, splat<F>(1.0f));
  return s2 / (1.0f + safe_sqrt(1.0f - s2));
}

/// Spot falloff for the cosine between the axis and the direction of emission.
template <class F>
inline F spot_falloff(const LightRecord<F>& r, F cosine) {
  const F start = r.scalar(4), end = r.scalar(5);
  const F x = clamp((cosine - end) / max(start - end, splat<F>(1e-7f)), 0.0f, 1.0f);
  return x * x * (3.0f - 2.0f * x);
}

/// Calls fn(map, mask) for the environment maps among the `infinite` lanes.
template <class F, class Fn>
inline void for_each_environment(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> infinite,
                                 Fn&& fn) {
  if (lights.environments.empty()) return;
  const F number = r.scalar(4);
  for (size_t k = 0; k < lights.environments.size(); ++k) {
    const MaskOf<F> mask = mask_and(infinite, MaskOf<F>(number == static_cast<float>(k)));
    if (any(mask)) fn(lights.environments[k], mask);
  }
}

/// Density per unit solid angle, without selection, of sampling direction `wi` of infinite lights.
template <class F>
inline F infinite_pdf(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> infinite,
                      const Vec3<F>& wi) {
  F pdf = splat<F>(1 / (4 * kPi));
  for_each_environment<F>(lights, r, infinite, [&](const EnvironmentMap& map, MaskOf<F> m) {
    pdf = select(m, map.pdf<F>(map.texel<F>(wi)), pdf);
  });
  return pdf;
}

/// Radiance of infinite lights from direction `wi`.
template <class F>
inline Vec3<F> infinite_radiance(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> infinite,
                                 const Vec3<F>& wi) {
  Vec3<F> radiance = r.vec(kLightRadiance);
  for_each_environment<F>(lights, r, infinite, [&](const EnvironmentMap& map, MaskOf<F> m) {
    radiance = select(m, map.radiance<F>(map.texel<F>(wi)), radiance);
  });
  return radiance;
}

/// Density per unit *area at the light* of direct sampling choosing a point of `light` from `reference`,
/// which sees it in unit direction `wi`, with selection. Point, spot and distant lights: the selection
/// probability; infinite lights: per unit solid angle.
template <class F>
inline F direct_pdf_area(const LightTable& lights, IntOf<F> light, const Vec3<F>& reference,
                         const Vec3<F>& wi, F distance2, F cos_light) {
  const LightRecord<F> r(lights, light);
  const IntOf<F> type = gather(lights.type.data(), light);
  const F select_pdf = r.scalar(kLightSelect);
  F pdf = 1.0f / r.scalar(kLightArea);
  if (lights.any_sphere) {
    const Vec3<F> to_center = r.vec(kLightP) - reference;
    const F d2 = dot(to_center, to_center), radius = r.scalar(3);
    const MaskOf<F> cone = mask_and(MaskOf<F>(type == kSphereLight), MaskOf<F>(d2 > radius * radius));
    const F q = one_minus_cos_cone(radius, select(cone, d2, splat<F>(1.0f)));
    pdf = select(cone, cos_light / (distance2 * (2.0f * kPi) * q), pdf);
  }
  if (lights.any_delta || !lights.infinite.empty()) {
    const MaskOf<F> infinite = MaskOf<F>(type == kInfiniteLight);
    const MaskOf<F> delta = mask_and(MaskOf<F>(type >= kPointLight), mask_not(infinite));
    pdf = select(delta, splat<F>(1.0f), pdf);
    if (!lights.infinite.empty()) pdf = select(infinite, infinite_pdf(lights, r, infinite, wi), pdf);
  }
  return pdf * select_pdf;
}

/// Density of emission sampling for the ray that leaves `light` against unit direction `wi` (which points to
/// the light), with cosine `cos_light` to its normal.
template <class F>
inline F emission_pdf(const LightTable& lights, IntOf<F> light, const Vec3<F>& wi, F cos_light) {
  const LightRecord<F> r(lights, light);
  const IntOf<F> type = gather(lights.type.data(), light);
  F pdf = cos_light * kInvPi / (r.scalar(kLightArea) * (1.0f + r.scalar(kLightTwoSided)));
  if (lights.any_delta) {
    pdf = select(MaskOf<F>(type == kPointLight), splat<F>(1 / (4 * kPi)), pdf);
    if (lights.any_spot) {
      const MaskOf<F> spot = MaskOf<F>(type == kSpotLight);
      pdf = select(spot, 1.0f / ((2 * kPi) * (1.0f - select(spot, r.scalar(5), F{}))), pdf);
    }
  }
  if (lights.any_infinite()) {
    const MaskOf<F> infinite = MaskOf<F>(type == kInfiniteLight), distant = MaskOf<F>(type == kDistantLight);
    const F radius = r.scalar(3);
    const F disk = kInvPi / (radius * radius);
    if (!lights.infinite.empty()) pdf = select(infinite, infinite_pdf(lights, r, infinite, wi) * disk, pdf);
    pdf = select(distant, disk, pdf);
  }
  return pdf * r.scalar(kLightSelect);
}

/// Radiance that leaves an area light at a point with normal `n` into direction `w` (0 on the dark side).
template <class F>
inline Vec3<F> emitted_radiance(const LightTable& lights, IntOf<F> light, const Vec3<F>& n,
                                const Vec3<F>& w) {
  const LightRecord<F> r(lights, light);
  const MaskOf<F> lit = mask_or(MaskOf<F>(dot(n, w) > 0.0f), MaskOf<F>(r.scalar(kLightTwoSided) > 0.0f));
  return select(lit, r.vec(kLightRadiance), Vec3<F>{});
}

template <class F>
inline F position_error(const Vec3<F>& p, float scale) {
  return (abs(p.x) + abs(p.y) + abs(p.z)) * scale;
}

/// `texel` chooses the texel of an environment image; unused without one.
template <class F>
inline DirectSample<F> sample_direct(const LightTable& lights, const Vec3<F>& reference, F u_select, F texel,
                                     F u, F v) {
  DirectSample<F> s;
  const IntOf<F> light = select_light(lights, u_select);
  const LightRecord<F> r(lights, light);
  const IntOf<F> type = gather(lights.type.data(), light);
  // Triangle.
  F b1, b2;
  square_to_triangle(u, v, &b1, &b2);
  s.point = r.vec(kLightP) + r.vec(kLightE1) * b1 + r.vec(kLightE2) * b2;
  s.normal = r.vec(kLightN);
  s.error = position_error(s.point, 0x1p-21f);
  if (lights.any_sphere) {
    const MaskOf<F> sphere = MaskOf<F>(type == kSphereLight);
    if (any(sphere)) {
      const Vec3<F> center = r.vec(kLightP);
      const F radius = r.scalar(3);
      const Vec3<F> to_center = center - reference;
      const F d2 = dot(to_center, to_center);
      const MaskOf<F> outside = MaskOf<F>(d2 > radius * radius);
      // Cone of directions that the sphere subtends; the point on it by the law of sines (pbrt-v4 §6.2.4).
      const F safe_d2 = select(outside, d2, radius * radius * 4.0f);
      const F q = one_minus_cos_cone(radius, safe_d2);
      const F one_minus_cos = u * q;
      const F sin2 = one_minus_cos * (2.0f - one_minus_cos);
      const F sin2_max = radius * radius / safe_d2;
      const F sin_max = sqrt(sin2_max);
      const F cos_alpha =
          min(sin2 / sin_max + (1.0f - one_minus_cos) * safe_sqrt(1.0f - sin2 / sin2_max), splat<F>(1.0f));
      const F sin_alpha = safe_sqrt(1.0f - cos_alpha * cos_alpha);
      F sp, cp;
      sincos_2pi(v, &sp, &cp);
      const MaskOf<F> use = mask_and(sphere, outside);
      const Vec3<F> axis = select(use, to_center * (1.0f / sqrt(safe_d2)), splat3<F>(0, 0, 1));
      const Frame<F> frame(-axis);
      const Vec3<F> n_cone = frame.to_world({sin_alpha * cp, sin_alpha * sp, cos_alpha});
      const Vec3<F> n = select(outside, n_cone, square_to_sphere(u, v));
      s.point = select(sphere, center + n * radius, s.point);
      s.normal = select(sphere, n * r.scalar(kLightOrientation), s.normal);
      s.error = select(sphere, position_error(center, 0x1p-21f) + radius * 0x1p-21f, s.error);
    }
  }
  if (lights.any_delta) {
    const MaskOf<F> point = mask_or(MaskOf<F>(type == kPointLight), MaskOf<F>(type == kSpotLight));
    s.point = select(point, r.vec(kLightP), s.point);
    s.error = select(point, F{}, s.error);
    s.delta = point;
  } else {
    s.delta = splat_mask<F>(false);
  }
  const Vec3<F> d = s.point - reference;
  s.distance2 = dot(d, d);
  const MaskOf<F> apart = MaskOf<F>(s.distance2 > 0.0f);
  s.wi = d * (1.0f / sqrt(select(apart, s.distance2, splat<F>(1.0f))));
  const F cosine = -dot(s.wi, s.normal);
  s.radiance = r.vec(kLightRadiance);
  const MaskOf<F> lit = mask_or(MaskOf<F>(cosine > 0.0f), mask_and(MaskOf<F>(r.scalar(kLightTwoSided) > 0.0f),
                                                                   MaskOf<F>(cosine != 0.0f)));
  s.cos_light = select(s.delta, splat<F>(1.0f), abs(cosine));
  s.radiance = select(mask_and(apart, mask_or(lit, s.delta)), s.radiance, Vec3<F>{});
  if (lights.any_spot) {
    const MaskOf<F> spot = MaskOf<F>(type == kSpotLight);
    s.radiance = select(spot, s.radiance * spot_falloff(r, -dot(s.wi, r.vec(kLightN))), s.radiance);
  }
  s.infinite = splat_mask<F>(false);
  const F safe_cos = select(MaskOf<F>(s.cos_light > 0.0f), s.cos_light, splat<F>(1.0f));
  s.pdf =
      direct_pdf_area(lights, light, reference, s.wi, select(apart, s.distance2, splat<F>(1.0f)), safe_cos) *
      s.distance2 / safe_cos;
  if (lights.any_infinite()) {
    const MaskOf<F> infinite = MaskOf<F>(type == kInfiniteLight), distant = MaskOf<F>(type == kDistantLight);
    Vec3<F> w = square_to_sphere(u, v);
    Vec3<F> radiance = r.vec(kLightRadiance);
    F pdf = splat<F>(1 / (4 * kPi));
    for_each_environment<F>(lights, r, infinite, [&](const EnvironmentMap& map, MaskOf<F> m) {
      IntOf<F> chosen;
      w = select(m, map.sample(texel, u, v, &chosen), w);
      radiance = select(m, map.radiance<F>(chosen), radiance);
      pdf = select(m, map.pdf<F>(chosen), pdf);
    });
    w = select(distant, -r.vec(kLightN), w);
    pdf = select(distant, splat<F>(1.0f), pdf);
    s.infinite = mask_or(infinite, distant);
    s.delta = mask_or(s.delta, distant);
    s.wi = select(s.infinite, w, s.wi);
    s.radiance = select(s.infinite, radiance, s.radiance);
    s.cos_light = select(s.infinite, splat<F>(1.0f), s.cos_light);
    s.pdf = select(s.infinite, r.scalar(kLightSelect) * pdf, s.pdf);
  }
  s.pdf_emission = emission_pdf(lights, light, s.wi, s.cos_light);
  return s;
}

template <class F>
inline EmissionSample<F> sample_emission(const LightTable& lights, F u_select, F texel, F pu, F pv, F du,
                                         F dv) {
  EmissionSample<F> s;
  s.light = select_light(lights, u_select);
  const LightRecord<F> r(lights, s.light);
  const IntOf<F> type = gather(lights.type.data(), s.light);
  F b1, b2;
  square_to_triangle(pu, pv, &b1, &b2);
  s.point = r.vec(kLightP) + r.vec(kLightE1) * b1 + r.vec(kLightE2) * b2;
  s.normal = r.vec(kLightN);
  s.error = position_error(s.point, 0x1p-21f);
  if (lights.any_sphere) {
    const MaskOf<F> sphere = MaskOf<F>(type == kSphereLight);
    const Vec3<F> n = square_to_sphere(pu, pv);
    const Vec3<F> center = r.vec(kLightP);
    const F radius = r.scalar(3);
    s.point = select(sphere, center + n * radius, s.point);
    s.normal = select(sphere, n * r.scalar(kLightOrientation), s.normal);
    s.error = select(sphere, position_error(center, 0x1p-21f) + radius * 0x1p-21f, s.error);
  }
  // Two-sided emitters split the first direction coordinate.
  const MaskOf<F> two_sided = MaskOf<F>(r.scalar(kLightTwoSided) > 0.0f);
  const MaskOf<F> back = mask_and(two_sided, MaskOf<F>(du < 0.5f));
  const F half = select(back, du * 2.0f, du * 2.0f - 1.0f);
  const Vec3<F> local = square_to_cosine_hemisphere(select(two_sided, half, du), dv);
  s.delta = s.infinite = splat_mask<F>(false);
  const MaskOf<F> has_normal = MaskOf<F>(type <= kSphereLight);
  const Vec3<F> n = select(has_normal, s.normal, splat3<F>(0, 0, 1));
  const Frame<F> frame(select(back, -n, n));
  s.direction = frame.to_world(local);
  s.cos_light = local.z;
  Vec3<F> radiance = r.vec(kLightRadiance);
  if (lights.any_delta || !lights.infinite.empty()) {
    const MaskOf<F> spot = MaskOf<F>(type == kSpotLight), distant = MaskOf<F>(type == kDistantLight);
    const MaskOf<F> infinite = MaskOf<F>(type == kInfiniteLight);
    const MaskOf<F> at_point = mask_or(MaskOf<F>(type == kPointLight), spot);
    Vec3<F> w = square_to_sphere(du, dv);
    if (lights.any_spot) {
      const F cosine = 1.0f - du * (1.0f - r.scalar(5));
      const F sine = safe_sqrt(1.0f - cosine * cosine);
      F sp, cp;
      sincos_2pi(dv, &sp, &cp);
      const Frame<F> cone(select(spot, r.vec(kLightN), splat3<F>(0, 0, 1)));
      w = select(spot, cone.to_world({sine * cp, sine * sp, cosine}), w);
      radiance = select(spot, radiance * spot_falloff(r, cosine), radiance);
    }
    for_each_environment<F>(lights, r, infinite, [&](const EnvironmentMap& map, MaskOf<F> m) {
      IntOf<F> chosen;
      w = select(m, -map.sample(texel, du, dv, &chosen), w);
      radiance = select(m, map.radiance<F>(chosen), radiance);
    });
    w = select(distant, r.vec(kLightN), w);
    s.direction = select(has_normal, s.direction, w);
    s.cos_light = select(has_normal, s.cos_light, splat<F>(1.0f));
    s.point = select(at_point, r.vec(kLightP), s.point);
    s.error = select(has_normal, s.error, F{});
    s.delta = mask_or(at_point, distant);
    s.infinite = mask_or(infinite, distant);
    if (lights.any_infinite()) {
      // A disk across the bounding sphere, in front of the scene.
      const Frame<F> disk(w);
      F x, y;
      square_to_disk(pu, pv, &x, &y);
      const F radius = r.scalar(3);
      const Vec3<F> on_disk = r.vec(kLightP) + (disk.s * x + disk.t * y - w) * radius;
      s.point = select(s.infinite, on_disk, s.point);
    }
  }
  s.pdf = emission_pdf(lights, s.light, -s.direction, s.cos_light);
  const F cos_over_pdf = s.cos_light / s.pdf;
  s.power = radiance * cos_over_pdf;
  return s;
}

}  // namespace lightmill
