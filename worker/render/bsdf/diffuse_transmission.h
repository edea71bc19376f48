#pragma once
// Lambertian reflection and transmission, both sides alike: paper, leaves, lamp shades.
//   f = reflectance / pi on wo's side, transmittance / pi on the other
// There is no interface, so radiance is not scaled on the way through and f is reciprocal.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

/// Probability of sampling a reflection: by the larger channels. It does not depend on directions.
template <class F>
inline F reflection_probability(const BsdfParams<F>& params) {
  const F r = max_component(params.rgb(0)), t = max_component(params.rgb(3));
  const F sum = r + t;
  const MaskOf<F> any_light = MaskOf<F>(sum > 0.0f);
  return select(any_light, r / select(any_light, sum, splat<F>(1.0f)), splat<F>(1.0f));
}

template <class F>
inline BsdfEval<F> eval_diffuse_transmission(const BsdfParams<F>& params, const Vec3<F>& wo,
                                             const Vec3<F>& wi) {
  const F p = reflection_probability(params);
  const MaskOf<F> reflects = same_side(wo, wi);
  const F density = select(reflects, p, 1.0f - p) * kInvPi;
  return {select(reflects, params.rgb(0), params.rgb(3)) * splat<F>(kInvPi), density * abs(wi.z),
          density * abs(wo.z)};
}

template <class F>
inline BsdfSample<F> sample_diffuse_transmission(const BsdfParams<F>& params, const Vec3<F>& wo, F u, F v) {
  const F p = reflection_probability(params);
  const MaskOf<F> reflect = choose_lobe(p, &u);
  const F chosen = select(reflect, p, 1.0f - p);
  BsdfSample<F> s;
  s.wi = square_to_cosine_hemisphere(u, v);
  s.wi.z = copysign(s.wi.z, select(reflect, wo.z, -wo.z));
  s.weight = select(reflect, params.rgb(0), params.rgb(3)) * (1.0f / chosen);
  s.pdf = chosen * abs(s.wi.z) * kInvPi;
  s.pdf_reverse = chosen * abs(wo.z) * kInvPi;
  s.valid = mask_and(MaskOf<F>(wo.z != 0.0f), MaskOf<F>(chosen > 0.0f));
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
