#pragma once
// What varies over an emitter: its radiance, by a texture, and its alpha mask.
//
// A camera ray that meets the mask is stopped with probability alpha (alpha_mask.h) and then sees the whole
// radiance. A point that is sampled on the light, for next event, for a light path or for light tracing,
// counts with the factor alpha instead. Either way a path's expectation has the factor alpha once, and
// densities of directions and points are those without a mask. So MIS weights need not know of it. Points are
// sampled uniformly, whatever the texture. Only the choice among lights follows its mean.
#include "worker/render/light/light_sampling.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Factor of an emitter's radiance where a camera path hits it. Never negative.
Vec3<float> pattern_at_hit(const RenderScene& scene, const EmitterPattern& pattern, const TexturePoint& at);
/// The same with alpha, for a point sampled on the light: barycentrics (b1, b2) on a triangle, or the unit
/// direction `n` from a sphere's centre.
Vec3<float> pattern_at_sample(const RenderScene& scene, const EmitterPattern& pattern, bool sphere, float b1,
                              float b2, const Vec3<float>& n, const Vec3<float>& p);

/// Calls value(pattern, lane) -> Vec3<float> for the lanes in `active` whose light has a pattern; 1
/// elsewhere. `unseen` receives the lanes whose light no ray can meet.
template <class F, class Fn>
inline Vec3<F> pattern_per_lane(const LightTable& lights, IntOf<F> light, MaskOf<F> active, MaskOf<F>* unseen,
                                Fn&& value) {
  float rgb[3][8];
  int32_t hidden[8] = {};
  const unsigned bits = mask_bits(active);
  for (int l = 0; l < kWidth<F>; ++l) {
    rgb[0][l] = rgb[1][l] = rgb[2][l] = 1;
    const int32_t number = bits >> l & 1 ? lights.pattern_of[static_cast<size_t>(lane(light, l))] : -1;
    if (number < 0) continue;
    const EmitterPattern& pattern = lights.patterns[static_cast<size_t>(number)];
    const Vec3<float> c = value(pattern, l);
    rgb[0][l] = c.x, rgb[1][l] = c.y, rgb[2][l] = c.z;
    hidden[l] = pattern.unseen;
  }
  if (unseen) *unseen = MaskOf<F>(load_int<F>(hidden) != 0);
  return {load<F>(rgb[0]), load<F>(rgb[1]), load<F>(rgb[2])};
}

template <class F>
inline Vec3<float> lane_of(const Vec3<F>& v, int l) {
  return {lane(v.x, l), lane(v.y, l), lane(v.z, l)};
}

/// Factor of the radiance where camera paths hit emitters at texture coordinates (u, v).
template <class F>
inline Vec3<F> hit_pattern(const RenderScene& scene, IntOf<F> light, MaskOf<F> active, F u, F v,
                           const Vec3<F>& p) {
  return pattern_per_lane<F>(scene.lights, light, active, nullptr, [&](const EmitterPattern& pattern, int l) {
    const Vec3<float> at = lane_of(p, l);
    return pattern_at_hit(scene, pattern, {lane(u, l), lane(v, l), scene.scene_point({at.x, at.y, at.z})});
  });
}

/// Factor of a sample of a light. A light that no ray can meet becomes a delta light: only the sampling of
/// lights finds it.
template <class F, class Sample>
inline Vec3<F> sample_pattern(const RenderScene& scene, MaskOf<F> active, Sample* s) {
  const F side = LightRecord<F>(scene.lights, s->light).scalar(kLightOrientation);
  MaskOf<F> unseen;
  const Vec3<F> factor =
      pattern_per_lane<F>(scene.lights, s->light, active, &unseen, [&](const EmitterPattern& pattern, int l) {
        const float outward = lane(side, l);  // 0 for a triangle
        return pattern_at_sample(scene, pattern, outward != 0, lane(s->b1, l), lane(s->b2, l),
                                 lane_of(s->normal, l) * outward, lane_of(s->point, l));
      });
  s->delta = mask_or(s->delta, unseen);
  return factor;
}
template <class F>
inline void apply_pattern(const RenderScene& scene, MaskOf<F> active, DirectSample<F>* s) {
  s->radiance = s->radiance * sample_pattern<F>(scene, active, s);
}
template <class F>
inline void apply_pattern(const RenderScene& scene, MaskOf<F> active, EmissionSample<F>* s) {
  s->pattern = sample_pattern<F>(scene, active, s);
  s->power = s->power * s->pattern;
}

}  // namespace lightmill
