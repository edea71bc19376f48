#pragma once
// One light per lane: its record, its radiance, and the densities that both directions of sampling share. A
// function with kAnyLight handles even emitters alone if that is false (kernel_set.h).
#include "worker/render/guiding/emission_guide.h"
#include "worker/render/light/alias_table.h"
#include "worker/render/light/light_table.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

/// Selects a light for a light path.
template <class F>
inline IntOf<F> select_light(const LightTable& lights, F u) {
  return select_alias(lights.alias_keep, lights.alias, u);
}

template <class F>
struct LightRecord {
  const float* base;
  IntOf<F> offset;
  LightRecord(const LightTable& lights, IntOf<F> index)
      : base(lights.records.data()), offset(index * kLightFloats) {}
  LightRecord(const LightRecord&) = delete;
  LightRecord& operator=(const LightRecord&) = delete;
  /// Goes on to what it is at `time` in [0, 1], for lights that move.
  void move_to(const LightTable& lights, IntOf<F> index, F time) {
    if (!lights.any_moving()) return;
    int32_t first[kWidth<F>];
    for (int l = 0; l < kWidth<F>; ++l) {
      first[l] = l * kLightFloats;
      lights.record_at(lane(index, l), lane(time, l), moved_ + first[l]);
    }
    base = moved_;
    offset = load_int<F>(first);
  }
  F scalar(int slot) const { return gather(base + slot, offset); }
  Vec3<F> vec(int slot) const {
    F r[3];
    load_triples(base + slot, offset, r);
    return {r[0], r[1], r[2]};
  }

 private:
  alignas(32) float moved_[kWidth<F> * kLightFloats + 4];  // vector loads read past the last one
};

/// Spot falloff. It takes 1 - the cosine between the axis and the direction of emission, as cosines of narrow
/// cones are all 1. Cycles' spots fall as the cosine, too.
template <class F>
inline F spot_falloff(const LightRecord<F>& r, F one_minus_cos) {
  const F start = r.scalar(4), end = r.scalar(5);
  const F x = clamp((end - one_minus_cos) / max(end - start, splat<F>(1e-30f)), 0.0f, 1.0f);
  return x * x * (3.0f - 2.0f * x) * (1.0f - r.scalar(6) * one_minus_cos);
}

/// 1 - the cosine between unit vectors, by their chord.
template <class F>
inline F one_minus_cos(const Vec3<F>& a, const Vec3<F>& b) {
  const Vec3<F> chord = a - b;
  return 0.5f * dot(chord, chord);
}

/// The part of a flat lamp's radiance that its spread leaves at the cosine to its normal; 1 without one.
template <class F>
inline F lamp_spread(const LightRecord<F>& r, F cosine) {
  const F tangent = safe_sqrt(1.0f - cosine * cosine) / max(cosine, splat<F>(1e-12f));
  return max(1.0f - tangent * r.scalar(kLightOrientation), F{});
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

/// Calls fn(portal, mask) for the portals of the `infinite` lanes.
template <class F, class Fn>
inline void for_each_portal(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> infinite, Fn&& fn) {
  if (lights.portals.empty()) return;
  const F number = r.scalar(6);
  for (size_t k = 0; k < lights.portals.size(); ++k) {
    const MaskOf<F> mask = mask_and(infinite, MaskOf<F>(number == static_cast<float>(k + 1)));
    if (any(mask)) fn(lights.portals[k], mask);
  }
}

/// Calls fn(cells, mask) for the emission cells of the `distant` lanes.
template <class F, class Fn>
inline void for_each_cells(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> distant, Fn&& fn) {
  if (lights.emission_cells.empty()) return;
  const F number = r.scalar(7);
  for (size_t k = 0; k < lights.emission_cells.size(); ++k) {
    const MaskOf<F> mask = mask_and(distant, MaskOf<F>(number == static_cast<float>(k + 1)));
    if (any(mask)) fn(lights.emission_cells[k], mask);
  }
}

/// Density per unit area of points drawn by `cells` on a square of half side `radius` around `center`, across
/// the unit axis of `frame`: at the point that `at` lies before or behind.
template <class F>
inline F cells_density(const BinnedDensity& cells, const Frame<F>& frame, const Vec3<F>& center, F radius,
                       const Vec3<F>& at) {
  const Vec3<F> d = (at - center) * (1.0f / radius);
  return square_density<F>(cells, IntOf<F>{}, dot(d, frame.s), dot(d, frame.t)) / (radius * radius);
}

/// Calls fn(map, mask) for the maps of lights at a point among the lanes.
template <class F, class Fn>
inline void for_each_image(const LightTable& lights, const LightRecord<F>& r, IntOf<F> type, Fn&& fn) {
  if (!lights.any_imaged()) return;
  const F number = r.scalar(4);
  const auto each = [&](const auto& maps, LightType of) {
    for (size_t k = 0; k < maps.size(); ++k) {
      const MaskOf<F> mask = mask_and(MaskOf<F>(type == of), MaskOf<F>(number == static_cast<float>(k)));
      if (any(mask)) fn(maps[k], mask);
    }
  };
  each(lights.goniometers, kGoniometricLight);
  each(lights.projectors, kProjectionLight);
}

/// Which infinite lights are suns.
template <class F>
inline MaskOf<F> suns(const LightRecord<F>& r, MaskOf<F> infinite) {
  return mask_and(infinite, MaskOf<F>(r.scalar(4) == kSunCone));
}

/// Whether direction `wi`, to the light, is in a sun's cone widened by `margin` (radians). It compares
/// chords, 2 sin(angle / 2), as cosines of small angles are all 1.
template <class F>
inline MaskOf<F> in_sun(const LightRecord<F>& r, const Vec3<F>& wi, float margin) {
  const Vec3<F> chord = wi + r.vec(kLightN);
  const F widest = sqrt(2.0f * max(r.scalar(5), F{})) + margin;
  return MaskOf<F>(dot(chord, chord) <= widest * widest);
}

/// Unit direction to the sun, uniform in its cone.
template <class F>
inline Vec3<F> sample_sun(const LightRecord<F>& r, MaskOf<F> sun, F u, F v) {
  const F one_minus_cos = u * select(sun, r.scalar(5), F{});
  const F sine = safe_sqrt(one_minus_cos * (2.0f - one_minus_cos));
  F sp, cp;
  sincos_2pi(v, &sp, &cp);
  const Frame<F> frame(select(sun, -r.vec(kLightN), splat3<F>(0, 0, 1)));
  return frame.to_world({sine * cp, sine * sp, 1.0f - one_minus_cos});
}

/// Density per unit solid angle of the directions of infinite lights, drawn without regard to portals.
/// of_map(map) is that of an environment map.
template <class F, class OfMap>
inline F infinite_pdf_with(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> infinite,
                           const Vec3<F>& wi, OfMap&& of_map) {
  F pdf = splat<F>(1 / (4 * kPi));
  for_each_environment<F>(lights, r, infinite,
                          [&](const EnvironmentMap& map, MaskOf<F> m) { pdf = select(m, of_map(map), pdf); });
  if (lights.any_sun) {
    const MaskOf<F> sun = suns(r, infinite);
    // A sampled direction must count as inside when it comes back rounded: the margin is its rounding.
    const F inside = 1.0f / ((2 * kPi) * select(sun, r.scalar(5), splat<F>(1.0f)));
    pdf = select(sun, select(in_sun(r, wi, 0x1p-22f), inside, F{}), pdf);
  }
  return pdf;
}

/// The same for light paths, which draw in proportion to the light.
template <class F>
inline F infinite_pdf(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> infinite,
                      const Vec3<F>& wi) {
  return infinite_pdf_with<F>(lights, r, infinite, wi,
                              [&](const EnvironmentMap& map) { return map.pdf<F>(map.texel<F>(wi)); });
}

/// The same for next-event estimation at `reference`.
template <class F>
inline F infinite_pdf_at(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> infinite,
                         const Vec3<F>& reference, const Vec3<F>& wi) {
  if (lights.guide.empty()) return infinite_pdf(lights, r, infinite, wi);
  const IntOf<F> table = lights.guide.table_at<F>(reference);
  return infinite_pdf_with<F>(lights, r, infinite, wi, [&](const EnvironmentMap& map) {
    return map.bins.empty() ? map.pdf<F>(map.texel<F>(wi)) : map.pdf_by<F>(table, wi);
  });
}

/// Turns `pdf` of infinite_pdf_at into that of next-event estimation at `reference`, where with portals half
/// of the directions are drawn by area.
template <class F>
inline F through_portal_pdf(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> infinite,
                            const Vec3<F>& reference, const Vec3<F>& wi, F pdf) {
  for_each_portal<F>(lights, r, infinite, [&](const Portal& portal, MaskOf<F> m) {
    pdf = select(m, 0.5f * (pdf + portal_area_pdf(portal, reference, wi)), pdf);
  });
  return pdf;
}

/// The lanes where portals let light from direction `wi` reach `p`.
template <class F, bool kAnyLight = true>
inline MaskOf<F> through_portals(const LightTable& lights, IntOf<F> light, const Vec3<F>& p,
                                 const Vec3<F>& wi) {
  MaskOf<F> open = splat_mask<F>(true);
  if (!kAnyLight || lights.portals.empty()) return open;
  const MaskOf<F> infinite = MaskOf<F>(gather(lights.type.data(), light) == kInfiniteLight);
  for_each_portal<F>(lights, LightRecord<F>(lights, light), infinite, [&](const Portal& portal, MaskOf<F> m) {
    open = mask_and(open, mask_or(mask_not(m), passes(portal, p, wi)));
  });
  return open;
}

/// Radiance of infinite lights from direction `wi`, without regard to portals.
template <class F>
inline Vec3<F> infinite_radiance(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> infinite,
                                 const Vec3<F>& wi) {
  Vec3<F> radiance = r.vec(kLightRadiance);
  for_each_environment<F>(lights, r, infinite, [&](const EnvironmentMap& map, MaskOf<F> m) {
    radiance = select(m, map.radiance<F>(map.texel<F>(wi)), radiance);
  });
  if (lights.any_sun)
    radiance = select(mask_and(suns(r, infinite), mask_not(in_sun(r, wi, 0.0f))), Vec3<F>{}, radiance);
  return radiance;
}

/// Density per unit area across `wi` of where light paths start that come from lights `at_infinity` in unit
/// direction `wi`: on a disk across the scene, or at a portal of an `infinite` light.
template <class F>
inline F area_density(const LightTable& lights, const LightRecord<F>& r, MaskOf<F> at_infinity,
                      MaskOf<F> infinite, const Vec3<F>& wi) {
  const F radius = select(at_infinity, r.scalar(3), splat<F>(1.0f));  // others may have 0 there
  F density = kInvPi / (radius * radius);
  for_each_portal<F>(lights, r, infinite, [&](const Portal& portal, MaskOf<F> m) {
    density = select(m, portal_point_pdf(portal, wi), density);
  });
  return density;
}

/// Density of facing lamps for lines along which light paths leave, per unit area across and solid angle,
/// given the lamp.
template <class F>
inline F facing_emission_pdf(const LightRecord<F>& r) {
  const F end = r.scalar(5);
  const F width = select(MaskOf<F>(end > 0.0f), end, splat<F>(2.0f));
  return 1.0f / ((2 * kPi) * width * max(r.scalar(kLightArea), splat<F>(1e-30f)));
}

/// Density of emission sampling, per unit area x unit solid angle, for the ray that leaves `light` against
/// unit direction `wi` (which points to the light) and gets to `at`. `cos_light`: its cosine to the light's
/// normal.
template <class F, bool kAnyLight = true>
inline F emission_pdf(const LightTable& lights, IntOf<F> light, const Vec3<F>& at, const Vec3<F>& wi,
                      F cos_light, F time = F{}) {
  LightRecord<F> r(lights, light);
  if constexpr (kAnyLight) r.move_to(lights, light, time);
  const IntOf<F> type = gather(lights.type.data(), light);
  F pdf = cos_light * kInvPi / (r.scalar(kLightArea) * (1.0f + r.scalar(kLightTwoSided)));
  if (kAnyLight && lights.any_delta) {
    pdf = select(MaskOf<F>(type == kPointLight), splat<F>(1 / (4 * kPi)), pdf);
    if (lights.any_spot) {
      const MaskOf<F> spot = MaskOf<F>(type == kSpotLight);
      pdf = select(spot, 1.0f / ((2 * kPi) * select(spot, r.scalar(5), splat<F>(1.0f))), pdf);
    }
    for_each_image<F>(lights, r, type, [&](const auto& map, MaskOf<F> m) {
      pdf = select(m, map.template pdf_towards<F>(-wi), pdf);
    });
  }
  if (kAnyLight && lights.any_facing)
    pdf = select(MaskOf<F>(type == kFacingLamp), facing_emission_pdf(r), pdf);
  if (kAnyLight && lights.any_infinite()) {
    const MaskOf<F> infinite = MaskOf<F>(type == kInfiniteLight), distant = MaskOf<F>(type == kDistantLight);
    const F disk = area_density(lights, r, mask_or(infinite, distant), infinite, wi);
    if (!lights.infinite.empty()) pdf = select(infinite, infinite_pdf(lights, r, infinite, wi) * disk, pdf);
    pdf = select(distant, disk, pdf);
    for_each_cells<F>(lights, r, distant, [&](const BinnedDensity& cells, MaskOf<F> m) {
      const Frame<F> frame(select(m, r.vec(kLightN), splat3<F>(0, 0, 1)));
      pdf = select(
          m, cells_density<F>(cells, frame, r.vec(kLightP), select(m, r.scalar(3), splat<F>(1.0f)), at), pdf);
    });
  }
  if (kAnyLight && lights.has_emission_guide()) {
    const EmissionGuide<F> guide(lights, light, type, r.vec(kLightN), r.scalar(kLightTwoSided));
    pdf = select(guide.mask, guide.density(-wi, cos_light) / r.scalar(kLightArea), pdf);
  }
  return pdf * r.scalar(kLightSelect);
}

/// Radiance that leaves an area light at a point with normal `n` into direction `w` (0 on the dark side).
template <class F>
inline Vec3<F> emitted_radiance(const LightTable& lights, IntOf<F> light, const Vec3<F>& n,
                                const Vec3<F>& w) {
  const LightRecord<F> r(lights, light);
  const MaskOf<F> lit = mask_or(MaskOf<F>(dot(n, w) > 0.0f), MaskOf<F>(r.scalar(kLightTwoSided) > 0.0f));
  Vec3<F> radiance = r.vec(kLightRadiance);
  if (lights.any_flat_lamp) {
    const IntOf<F> type = gather(lights.type.data(), light);
    const MaskOf<F> lamp = mask_or(MaskOf<F>(type == kRectangleLamp), MaskOf<F>(type == kEllipseLamp));
    const F cosine = select(mask_and(lamp, lit), dot(n, w), splat<F>(1.0f));
    radiance = select(lamp, radiance * lamp_spread(r, cosine), radiance);
  }
  return select(lit, radiance, Vec3<F>{});
}

template <class F>
inline F position_error(const Vec3<F>& p, float scale) {
  return (abs(p.x) + abs(p.y) + abs(p.z)) * scale;
}

}  // namespace lightmill
