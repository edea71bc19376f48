#pragma once
// Samples lights from a reference point, over a lane type. Densities are per unit solid angle at the
// reference point. See light_sampling.h.
#include <bit>

#include "worker/render/light/lamp.h"

namespace lightmill {

template <class F>
struct DirectSample {
  Vec3<F> point;     // on the light (for infinite lights: not used)
  Vec3<F> normal;    // there
  Vec3<F> wi;        // unit, from the reference point
  F distance2{};     // squared distance to `point`
  Vec3<F> radiance;  // towards the reference point; 0 on the dark side
  F pdf{};           // direct density
  F selection{};     // the probability of `light` in it
  F pdf_emission{};  // density of emission sampling producing the reversed ray
  F cos_light{};     // |cos| at the light (1 for all but area lights)
  F error{};         // bound of the position error of `point` per component
  MaskOf<F> delta{};
  MaskOf<F> infinite{};  // infinite or distant
  IntOf<F> light{};
  F b1{}, b2{};  // of a triangle: barycentrics of `point`
};

/// 1 - cos of the half angle under which a sphere is seen from distance^2 d2, without cancellation.
template <class F>
inline F one_minus_cos_cone(F radius, F d2) {
  const F s2 = min(radius * radius / d2, splat<F>(1.0f));
  return s2 / (1.0f + safe_sqrt(1.0f - s2));
}

/// Whether `reference` is outside of a sphere beyond doubt, by its squared distance `d2` from the centre. A
/// point of the sphere itself is not: it sees all of the inside, where the cone would be all but a half space
/// and holds nothing but the ground next to the point.
template <class F>
inline MaskOf<F> outside_sphere(const Vec3<F>& center, F radius, const Vec3<F>& reference, F d2) {
  // Several times what a ray's origin is moved by when it leaves the sphere (position_error).
  const F reach = radius + (position_error(center, 1) + position_error(reference, 1) + radius) * 0x1p-18f;
  return MaskOf<F>(d2 > reach * reach);
}

/// Density of direct sampling from `reference` for a point of `light`, given the light, per unit *area at the
/// light*. `wi`: unit direction in which the reference sees the point. Point, spot and distant lights: 1.
/// Infinite lights and facing lamps: per unit solid angle.
template <class F, bool kAnyLight = true>
inline F direct_pdf_of_light(const LightTable& lights, IntOf<F> light, const Vec3<F>& reference,
                             const Vec3<F>& wi, F distance2, F cos_light, F time = F{}) {
  LightRecord<F> r(lights, light);
  if constexpr (kAnyLight) r.move_to(lights, light, time);
  const IntOf<F> type = gather(lights.type.data(), light);
  F pdf = 1.0f / r.scalar(kLightArea);
  if (lights.any_sphere) {
    const Vec3<F> center = r.vec(kLightP), to_center = center - reference;
    const F d2 = dot(to_center, to_center), radius = r.scalar(3);
    const MaskOf<F> cone =
        mask_and(MaskOf<F>(type == kSphereLight), outside_sphere(center, radius, reference, d2));
    const F q = one_minus_cos_cone(radius, select(cone, d2, splat<F>(1.0f)));
    // Lights that are not spheres have no radius to divide by.
    pdf = select(cone, cos_light / select(cone, distance2 * (2.0f * kPi) * q, splat<F>(1.0f)), pdf);
  }
  if (kAnyLight && (lights.any_delta || !lights.infinite.empty())) {
    const MaskOf<F> infinite = MaskOf<F>(type == kInfiniteLight);
    const MaskOf<F> delta = mask_and(MaskOf<F>(type >= kPointLight), mask_not(infinite));
    pdf = select(delta, splat<F>(1.0f), pdf);
    if (!lights.infinite.empty()) {
      const F of_direction = infinite_pdf_at(lights, r, infinite, reference, wi);
      pdf = select(infinite, through_portal_pdf(lights, r, infinite, reference, wi, of_direction), pdf);
    }
  }
  if (kAnyLight && lights.any_facing) {
    const MaskOf<F> facing = MaskOf<F>(type == kFacingLamp);
    const FacingCone<F> cone(r, facing, reference);
    pdf = select(facing, select(cone.holds(wi, kConeRounding), cone.pdf(), F{}), pdf);
  }
  return pdf;
}

template <class F>
inline void to_lanes(const Vec3<F>& v, Vec3<float> (&out)[8]) {
  for (int l = 0; l < kWidth<F>; ++l) out[l] = {lane(v.x, l), lane(v.y, l), lane(v.z, l)};
}

/// Probability that next-event estimation at `reference` selects `light`. Inactive lanes may get anything.
template <class F, bool kAnyLight = true>
inline F direct_selection(const LightTable& lights, IntOf<F> light, const Vec3<F>& reference,
                          MaskOf<F> active = splat_mask<F>(true)) {
  const LightRecord<F> r(lights, light);
  if (kAnyLight && lights.guide.chooses())
    return lights.guide.probability_of<F>(lights.guide.table_at<F>(reference), light);
  const F by_power = r.scalar(kLightDirectSelect);
  if (!kAnyLight || lights.tree.empty()) return by_power;
  const MaskOf<F> in_tree = MaskOf<F>(by_power == 0.0f);
  float p[8] = {};
  int32_t index[8] = {};
  Vec3<float> at[8];
  to_lanes(reference, at);
  store(index, light);
  lights.tree.probability(at, index, mask_bits(mask_and(active, in_tree)), p);
  return select(in_tree, load<F>(p) * (1 - lights.infinity_share), by_power);
}

/// direct_pdf_of_light times the probability of selecting the light.
template <class F, bool kAnyLight = true>
inline F direct_pdf_area(const LightTable& lights, IntOf<F> light, const Vec3<F>& reference,
                         const Vec3<F>& wi, F distance2, F cos_light, MaskOf<F> active = splat_mask<F>(true),
                         F time = F{}) {
  return direct_pdf_of_light<F, kAnyLight>(lights, light, reference, wi, distance2, cos_light, time) *
         direct_selection<F, kAnyLight>(lights, light, reference, active);
}

/// Selects a light at `reference`. `more` extends `u`: a uniform of 24 bits is too coarse for thousands of
/// lights. If `lights.by_power_alone()`, `rest`, unless null, becomes what is left of `u`.
template <class F, bool kAnyLight = true>
inline IntOf<F> select_direct(const LightTable& lights, const Vec3<F>& reference, F u, F more, F* probability,
                              F* rest = nullptr) {
  if (kAnyLight && lights.guide.chooses()) {
    const IntOf<F> table = lights.guide.table_at<F>(reference);
    const IntOf<F> light = lights.guide.choose<F>(table, u);
    *probability = lights.guide.probability_of<F>(table, light);
    return light;
  }
  if (!kAnyLight || lights.tree.empty()) {
    const IntOf<F> light =
        select_alias(lights.direct_keep, lights.direct_alias, u, lights.count() > 1 ? rest : nullptr);
    *probability = LightRecord<F>(lights, light).scalar(kLightDirectSelect);
    return light;
  }
  const double share = double{lights.infinity_share};
  int32_t index[8];
  float p[8];
  double x[8];
  LightTree::Choice choice[8];
  Vec3<float> at[8];
  to_lanes(reference, at);
  unsigned in_tree = 0;
  for (int l = 0; l < kWidth<F>; ++l) {
    x[l] = double{lane(u, l)} + 0x1p-24 * double{lane(more, l)};
    if (x[l] < share) {
      const auto place = static_cast<size_t>(
          select_alias<float>(lights.direct_keep, lights.direct_alias, static_cast<float>(x[l] / share)));
      index[l] = lights.at_infinity[place];
      p[l] = lights.records[static_cast<size_t>(index[l]) * kLightFloats + kLightDirectSelect];
    } else {
      x[l] = (x[l] - share) / (1 - share);
      in_tree |= 1u << l;
    }
  }
  lights.tree.sample(at, x, in_tree, choice);
  for (unsigned bits = in_tree; bits != 0; bits &= bits - 1) {
    const auto l = static_cast<size_t>(std::countr_zero(bits));
    index[l] = choice[l].light;
    p[l] = choice[l].probability * (1 - lights.infinity_share);
  }
  *probability = load<F>(p);
  return load_int<F>(index);
}

/// Selects a light by `u_select` and samples it by u and v. `texel` chooses the texel of an environment
/// image, and extends `u_select` if there is a light tree; else it is not used. Where one of several lights
/// is chosen by power alone, what is left of `u_select` replaces `u`, so `u_select` may be that coordinate
/// itself. Then each light has stratified points. A number of its own for the choice would give it any of the
/// points that are stratified together. Lights that move are where they are at `time`. Of a volume light only
/// `light` and `selection` are of use (pipeline/connections/volume_light_sampling.h).
template <class F, bool kAnyLight = true>
inline DirectSample<F> sample_direct(const LightTable& lights, const Vec3<F>& reference, F u_select, F texel,
                                     F u, F v, F time = F{}) {
  DirectSample<F> s;
  F selection;
  const IntOf<F> light = select_direct<F, kAnyLight>(lights, reference, u_select, texel, &selection, &u);
  LightRecord<F> r(lights, light);
  if constexpr (kAnyLight) r.move_to(lights, light, time);
  const IntOf<F> type = gather(lights.type.data(), light);
  s.light = light;
  s.selection = selection;
  // Triangle.
  square_to_triangle(u, v, &s.b1, &s.b2);
  s.point = r.vec(kLightP) + r.vec(kLightE1) * s.b1 + r.vec(kLightE2) * s.b2;
  s.normal = r.vec(kLightN);
  if (kAnyLight && lights.any_flat_lamp) {
    const MaskOf<F> lamp = flat_lamps<F>(type);
    s.point = select(lamp, flat_lamp_point(r, type, u, v), s.point);
  }
  s.error = position_error(s.point, 0x1p-21f);
  if (lights.any_sphere) {
    const MaskOf<F> sphere = MaskOf<F>(type == kSphereLight);
    if (any(sphere)) {
      const Vec3<F> center = r.vec(kLightP);
      const F radius = r.scalar(3);
      const Vec3<F> to_center = center - reference;
      const F d2 = dot(to_center, to_center);
      const MaskOf<F> outside = outside_sphere(center, radius, reference, d2);
      // Cone of directions that the sphere subtends; theta at the reference, alpha at the centre, t the
      // distance to the near root in a form that does not cancel next to the sphere; sin alpha by the law of
      // sines (pbrt-v4 §6.2.4).
      const F safe_d2 = select(outside, d2, radius * radius * 4.0f);
      const F q = one_minus_cos_cone(radius, safe_d2);
      const F one_minus_cos = u * q;
      const F sin2 = one_minus_cos * (2.0f - one_minus_cos);
      const F sin2_max = radius * radius / safe_d2;
      const F sin_max = sqrt(sin2_max);
      const F cos_theta = 1.0f - one_minus_cos, sin_theta = sqrt(sin2);
      const F half_chord = safe_sqrt(1.0f - sin2 / sin2_max);  // over the radius
      const F distance = sqrt(safe_d2);
      const F t = (safe_d2 - radius * radius) / (distance * cos_theta + radius * half_chord);
      const F cos_alpha = min(sin2 / sin_max + cos_theta * half_chord, splat<F>(1.0f));
      const F sin_alpha = min(t * sin_theta / radius, splat<F>(1.0f));
      F sp, cp;
      sincos_2pi(v, &sp, &cp);
      const MaskOf<F> use = mask_and(sphere, outside);
      const Vec3<F> axis = select(use, to_center * (1.0f / distance), splat3<F>(0, 0, 1));
      const Frame<F> frame(-axis);
      const Vec3<F> n_cone = frame.to_world({sin_alpha * cp, sin_alpha * sp, cos_alpha});
      const Vec3<F> n = select(outside, n_cone, square_to_sphere(u, v));
      // Close to the surface, the point is better known from the reference than from the centre.
      const Vec3<F> from_reference =
          reference + frame.to_world({sin_theta * cp, sin_theta * sp, -cos_theta}) * t;
      const MaskOf<F> close = mask_and(outside, MaskOf<F>(t < radius));
      s.point = select(sphere, select(close, from_reference, center + n * radius), s.point);
      s.normal = select(sphere, n * r.scalar(kLightOrientation), s.normal);
      s.error = select(sphere, position_error(center, 0x1p-21f) + radius * 0x1p-21f, s.error);
    }
  }
  if (kAnyLight && lights.any_delta) {
    const MaskOf<F> point = mask_and(MaskOf<F>(type >= kPointLight), MaskOf<F>(type < kInfiniteLight));
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
  if (kAnyLight && lights.any_spot) {
    const MaskOf<F> spot = MaskOf<F>(type == kSpotLight);
    s.radiance = select(spot, s.radiance * spot_falloff(r, one_minus_cos(-s.wi, r.vec(kLightN))), s.radiance);
  }
  if constexpr (kAnyLight) {
    for_each_image<F>(lights, r, type, [&](const auto& map, MaskOf<F> m) {
      s.radiance = select(mask_and(m, apart), map.template towards<F>(-s.wi), s.radiance);
    });
  }
  if (kAnyLight && lights.any_flat_lamp) {
    const MaskOf<F> lamp = mask_and(flat_lamps<F>(type), lit);
    s.radiance = select(lamp, s.radiance * lamp_spread(r, select(lamp, cosine, splat<F>(1.0f))), s.radiance);
  }
  s.infinite = splat_mask<F>(false);
  const F safe_cos = select(MaskOf<F>(s.cos_light > 0.0f), s.cos_light, splat<F>(1.0f));
  s.pdf = direct_pdf_of_light<F, kAnyLight>(lights, light, reference, s.wi,
                                            select(apart, s.distance2, splat<F>(1.0f)), safe_cos, time) *
          selection * s.distance2 / safe_cos;
  if (kAnyLight && lights.any_facing) {
    const MaskOf<F> facing = MaskOf<F>(type == kFacingLamp);
    const FacingCone<F> cone(r, facing, reference);
    const Vec3<F> w = cone.sample(u, v);
    const F distance = cone.distance * dot(cone.axis, w);
    s.wi = select(facing, w, s.wi);
    s.point = select(facing, reference + w * distance, s.point);
    s.normal = select(facing, -w, s.normal);
    s.distance2 = select(facing, distance * distance, s.distance2);
    s.cos_light = select(facing, splat<F>(1.0f), s.cos_light);
    const MaskOf<F> seen = MaskOf<F>(cone.width > 0.0f);
    s.radiance = select(facing, select(seen, facing_radiance(r, -w), Vec3<F>{}), s.radiance);
    s.pdf = select(facing, cone.pdf() * selection, s.pdf);
    s.delta = mask_and(s.delta, mask_not(facing));
  }
  if (kAnyLight && (lights.any_flat_lamp || lights.any_facing) && lights.lamps.empty())
    s.delta = mask_or(s.delta, mask_or(flat_lamps<F>(type), MaskOf<F>(type == kFacingLamp)));
  if (kAnyLight && lights.any_infinite()) {
    const MaskOf<F> infinite = MaskOf<F>(type == kInfiniteLight), distant = MaskOf<F>(type == kDistantLight);
    Vec3<F> w = square_to_sphere(u, v);
    Vec3<F> radiance = r.vec(kLightRadiance);
    F pdf = splat<F>(1 / (4 * kPi));
    // With a portal the number that picks a texel first decides whether a texel is picked.
    F pick = texel;
    for_each_portal<F>(lights, r, infinite, [&](const Portal&, MaskOf<F> m) {
      pick = select(m, select(MaskOf<F>(texel < 0.5f), texel * 2.0f, texel * 2.0f - 1.0f), pick);
    });
    for_each_environment<F>(lights, r, infinite, [&](const EnvironmentMap& map, MaskOf<F> m) {
      IntOf<F> chosen;
      F there;
      if (map.bins.empty()) {
        w = select(m, map.sample(pick, u, v, &chosen), w);
        there = map.pdf<F>(chosen);
      } else {
        const IntOf<F> table = lights.guide.table_at<F>(reference);
        w = select(m, map.sample_by<F>(table, pick, u, v, &chosen, &there), w);
      }
      radiance = select(m, map.radiance<F>(chosen), radiance);
      pdf = select(m, there, pdf);
    });
    if (lights.any_sun) {
      const MaskOf<F> sun = suns(r, infinite);
      w = select(sun, sample_sun(r, sun, u, v), w);
      pdf = select(sun, 1.0f / ((2 * kPi) * select(sun, r.scalar(5), splat<F>(1.0f))), pdf);
    }
    for_each_portal<F>(lights, r, infinite, [&](const Portal& portal, MaskOf<F> m) {
      const MaskOf<F> by_area = mask_and(m, MaskOf<F>(texel < 0.5f));
      const Vec3<F> to = portal_point(portal, u, v) - reference;
      const F d2 = dot(to, to);
      const MaskOf<F> off = MaskOf<F>(d2 > 0.0f);
      w = select(mask_and(by_area, off), to * (1.0f / sqrt(select(off, d2, splat<F>(1.0f)))), w);
      radiance = select(by_area, infinite_radiance(lights, r, m, w), radiance);
      pdf = select(by_area, infinite_pdf_at(lights, r, m, reference, w), pdf);
      pdf = through_portal_pdf(lights, r, m, reference, w, pdf);
      radiance = select(mask_and(m, mask_not(passes(portal, reference, w))), Vec3<F>{}, radiance);
    });
    w = select(distant, -r.vec(kLightN), w);
    pdf = select(distant, splat<F>(1.0f), pdf);
    s.infinite = mask_or(infinite, distant);
    s.delta = mask_or(s.delta, distant);
    s.wi = select(s.infinite, w, s.wi);
    s.radiance = select(s.infinite, radiance, s.radiance);
    s.cos_light = select(s.infinite, splat<F>(1.0f), s.cos_light);
    s.pdf = select(s.infinite, selection * pdf, s.pdf);
  }
  s.pdf_emission = emission_pdf<F, kAnyLight>(lights, light, reference, s.wi, s.cos_light, time);
  return s;
}

}  // namespace lightmill
