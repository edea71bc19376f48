#pragma once
// Samples rays that leave a light, over a lane type. Densities are per unit area x unit solid angle. See
// light_sampling.h.
#include "worker/render/light/emitter_point.h"

namespace lightmill {

template <class F>
struct EmissionSample {
  Vec3<F> point, normal, direction;
  Vec3<F> power;  // radiance x cos / pdf: the path's initial throughput
  F pdf{};        // emission density
  F cos_light{};
  F error{};
  IntOf<F> light{};
  MaskOf<F> delta{}, infinite{};
  F b1{}, b2{};     // of a triangle: barycentrics of `point`
  Vec3<F> pattern;  // with patterned emitters: what `power` was multiplied by (emitter_pattern.h)
};

template <class F, bool kAnyLight = true>
inline EmissionSample<F> sample_emission(const LightTable& lights, F u_select, F texel, F pu, F pv, F du,
                                         F dv, F time = F{}) {
  EmissionSample<F> s;
  s.light = select_light(lights, u_select);
  LightRecord<F> r(lights, s.light);
  if constexpr (kAnyLight) r.move_to(lights, s.light, time);
  const IntOf<F> type = gather(lights.type.data(), s.light);
  const EmitterPoint<F> p =
      emitter_point<F>(lights, r, type, pu, pv, [&] { return square_to_sphere(pu, pv); });
  s.point = p.at;
  s.normal = p.normal;
  s.error = p.error;
  s.b1 = p.b1;
  s.b2 = p.b2;
  // Two-sided emitters split the first direction coordinate.
  const MaskOf<F> two_sided = MaskOf<F>(r.scalar(kLightTwoSided) > 0.0f);
  const MaskOf<F> back = mask_and(two_sided, MaskOf<F>(du < 0.5f));
  const F half = select(back, du * 2.0f, du * 2.0f - 1.0f);
  const Vec3<F> local = square_to_cosine_hemisphere(select(two_sided, half, du), dv);
  s.delta = s.infinite = splat_mask<F>(false);
  const MaskOf<F> has_normal = MaskOf<F>(type <= kLastWithNormal);
  const Vec3<F> n = select(has_normal, s.normal, splat3<F>(0, 0, 1));
  const Frame<F> frame(select(back, -n, n));
  s.direction = frame.to_world(local);
  s.cos_light = local.z;
  Vec3<F> radiance = r.vec(kLightRadiance);
  if (kAnyLight && lights.any_flat_lamp)
    radiance = select(flat_lamps<F>(type), radiance * lamp_spread(r, s.cos_light), radiance);
  // Density by the chosen texel: at its border the direction may round into the next one.
  F of_texel{};
  if (kAnyLight && (lights.any_delta || !lights.infinite.empty())) {
    const MaskOf<F> distant = MaskOf<F>(type == kDistantLight);
    const MaskOf<F> infinite = MaskOf<F>(type == kInfiniteLight);
    const MaskOf<F> at_point = mask_and(MaskOf<F>(type >= kPointLight), MaskOf<F>(type < kInfiniteLight));
    Vec3<F> w = square_to_sphere(du, dv);
    if (lights.any_spot) {
      const MaskOf<F> spot = MaskOf<F>(type == kSpotLight);
      const F one_minus_cos = du * r.scalar(5);
      const F sine = safe_sqrt(one_minus_cos * (2.0f - one_minus_cos));
      F sp, cp;
      sincos_2pi(dv, &sp, &cp);
      const Frame<F> cone(select(spot, r.vec(kLightN), splat3<F>(0, 0, 1)));
      w = select(spot, cone.to_world({sine * cp, sine * sp, 1.0f - one_minus_cos}), w);
      radiance = select(spot, radiance * spot_falloff(r, one_minus_cos), radiance);
    }
    for_each_environment<F>(lights, r, infinite, [&](const EnvironmentMap& map, MaskOf<F> m) {
      IntOf<F> chosen;
      w = select(m, -map.sample(texel, du, dv, &chosen), w);
      radiance = select(m, map.radiance<F>(chosen), radiance);
      of_texel = select(m, map.pdf<F>(chosen) * area_density(lights, r, m, m, -w), of_texel);
    });
    for_each_image<F>(lights, r, type, [&](const auto& map, MaskOf<F> m) {
      IntOf<F> chosen;
      w = select(m, map.template sample<F>(texel, du, dv, &chosen), w);
      radiance = select(m, map.template radiance<F>(chosen), radiance);
      of_texel = select(m, map.template pdf<F>(chosen, w), of_texel);
    });
    if (lights.any_sun) {
      const MaskOf<F> sun = suns(r, infinite);
      w = select(sun, -sample_sun(r, sun, du, dv), w);
    }
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
      for_each_cells<F>(lights, r, distant, [&](const BinnedDensity& cells, MaskOf<F> m) {
        F cx, cy;
        const F of_cell = draw_in_square<F>(cells, IntOf<F>{}, texel, pu, pv, &cx, &cy);
        s.point = select(m, r.vec(kLightP) + (disk.s * cx + disk.t * cy - w) * radius, s.point);
        of_texel = select(m, of_cell / (radius * radius), of_texel);
      });
      for_each_portal<F>(
          lights, r, MaskOf<F>(type == kInfiniteLight), [&](const Portal& portal, MaskOf<F> m) {
            s.point = select(m, portal_point(portal, pu, pv) - w * splat<F>(portal.reach), s.point);
            // Directions that see the portal's back carry nothing.
            radiance = select(mask_and(m, MaskOf<F>(portal_cosine(portal, -w) <= 0.0f)), Vec3<F>{}, radiance);
          });
    }
  }
  if (kAnyLight && lights.any_facing) {
    const MaskOf<F> facing = MaskOf<F>(type == kFacingLamp);
    const F end = r.scalar(5);
    const MaskOf<F> spot = mask_and(facing, MaskOf<F>(end > 0.0f));  // others have no axis
    const F q = du * select(spot, end, splat<F>(2.0f)), sine = safe_sqrt(q * (2.0f - q));
    F sp, cp, x, y;
    sincos_2pi(dv, &sp, &cp);
    square_to_disk(pu, pv, &x, &y);
    const Frame<F> cone(select(spot, r.vec(kLightN), splat3<F>(0, 0, 1)));
    const Vec3<F> w = cone.to_world({sine * cp, sine * sp, 1.0f - q});
    const Frame<F> disk(w);
    const F radius = r.scalar(3);
    s.direction = select(facing, w, s.direction);
    s.point = select(facing, r.vec(kLightP) + (disk.s * x + disk.t * y) * radius, s.point);
    s.normal = select(facing, w, s.normal);
    s.error = select(facing, F{}, s.error);
    s.cos_light = select(facing, splat<F>(1.0f), s.cos_light);
    radiance = select(facing, facing_radiance(r, w), radiance);
  }
  if (kAnyLight && (lights.any_flat_lamp || lights.any_facing) && lights.lamps.empty())
    s.delta = mask_or(s.delta, mask_or(flat_lamps<F>(type), MaskOf<F>(type == kFacingLamp)));
  if (kAnyLight && lights.has_emission_guide()) {
    const EmissionGuide<F> guide(lights, s.light, type, r.vec(kLightN), r.scalar(kLightTwoSided));
    const GuidedDirection<F> d = guide.draw(texel, du, dv);
    s.direction = select(guide.mask, d.w, s.direction);
    s.cos_light = select(guide.mask, d.cos_light, s.cos_light);
    of_texel = select(guide.mask, d.pdf / r.scalar(kLightArea), of_texel);
    if (lights.any_spot) {
      const MaskOf<F> spot = mask_and(guide.mask, MaskOf<F>(type == kSpotLight));
      const F falloff = spot_falloff(r, one_minus_cos(r.vec(kLightN), d.w));
      radiance = select(spot, r.vec(kLightRadiance) * falloff, radiance);
    }
    radiance = select(mask_and(guide.mask, d.lost), Vec3<F>{}, radiance);
  }
  s.pdf = emission_pdf<F, kAnyLight>(lights, s.light, s.point, -s.direction, s.cos_light, time);
  if (kAnyLight && lights.any_texels())
    s.pdf = select(MaskOf<F>(of_texel > 0.0f), of_texel * r.scalar(kLightSelect), s.pdf);
  const F cos_over_pdf = s.cos_light / s.pdf;
  s.power = radiance * cos_over_pdf;
  return s;
}

}  // namespace lightmill
