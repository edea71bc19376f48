#pragma once
// Blender's Velvet BSDF: Ashikhmin, Premoze and Shirley, "A microfacet-based BRDF generator", 2000, both
// sides alike. Reciprocal. Directions are drawn evenly over the hemisphere.
//
// Parameters: 0-2 colour, 6 sigma.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/math/exp.h"
#include "worker/render/math/trig.h"

namespace lightmill {

template <class F>
inline BsdfEval<F> eval_velvet(const BsdfParams<F>& params, const Vec3<F>& wo, const Vec3<F>& wi) {
  const Vec3<F> h = wo + wi;
  const F h2 = dot(h, h);
  const F one = select(same_side(wo, wi), splat<F>(1.0f), F{}), pdf = one * (0.5f * kInvPi);
  const MaskOf<F> valid = mask_and(MaskOf<F>(h2 > 1e-12f), same_side(wo, wi));
  const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
  const F co = max(abs(wo.z), splat<F>(1e-6f)), ci = max(abs(wi.z), splat<F>(1e-6f));
  const F s2 = max(m.x * m.x + m.y * m.y, splat<F>(1e-8f)), c2 = m.z * m.z;
  const F inv = 1.0f / (params.p[6] * params.p[6]);
  const F d = exp_negative(-c2 / s2 * inv) * inv * kInvPi / (s2 * s2);
  const F slit = 2.0f * abs(m.z) / max(abs(dot(wo, m)), splat<F>(1e-6f));
  const F g = min(slit * min(co, ci), splat<F>(1.0f));
  const F value = select(valid, 0.25f * d * g / (co * ci), F{});
  return {params.rgb(0) * value, pdf, pdf};
}

template <class F>
inline BsdfSample<F> sample_velvet(const BsdfParams<F>& params, const Vec3<F>& wo, F u, F v) {
  BsdfSample<F> s;
  F sine, cosine;
  sincos_2pi(u, &sine, &cosine);
  const F z = 1.0f - v, r = safe_sqrt(1.0f - z * z);
  s.wi = {r * cosine, r * sine, copysign(z, wo.z)};
  const BsdfEval<F> e = eval_velvet(params, wo, s.wi);
  s.valid = mask_and(MaskOf<F>(wo.z != 0.0f), MaskOf<F>(e.pdf > 0.0f));
  s.weight = e.f * (abs(s.wi.z) / select(s.valid, e.pdf, splat<F>(1.0f)));
  s.pdf = e.pdf;
  s.pdf_reverse = e.pdf_reverse;
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
