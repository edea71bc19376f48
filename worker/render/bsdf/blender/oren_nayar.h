#pragma once
// Blender's Diffuse BSDF with a roughness: Oren and Nayar's model as Fujii simplified it ("A tiny improvement
// of Oren-Nayar reflectance model", 2013), both sides alike. Reciprocal.
//
// Parameters: 0-2 colour, 6 roughness.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

template <class F>
inline BsdfEval<F> eval_oren_nayar(const BsdfParams<F>& params, const Vec3<F>& wo, const Vec3<F>& wi) {
  const F co = abs(wo.z), ci = abs(wi.z), sigma = params.p[6];
  const F a = 1.0f / (kPi + (kPi * 0.5f - 2.0f / 3.0f) * sigma);
  const F t = wo.x * wi.x + wo.y * wi.y;  // of a pair on one side: cos(wo, wi) - co ci
  const F spread = select(MaskOf<F>(t > 0.0f), t / max(max(co, ci), splat<F>(1e-12f)), t);
  const F one = select(same_side(wo, wi), splat<F>(1.0f), F{});
  return {params.rgb(0) * (max(a * (1.0f + sigma * spread), F{}) * one), ci * kInvPi * one,
          co * kInvPi * one};
}

template <class F>
inline BsdfSample<F> sample_oren_nayar(const BsdfParams<F>& params, const Vec3<F>& wo, F u, F v) {
  BsdfSample<F> s;
  s.wi = square_to_cosine_hemisphere(u, v);
  s.wi.z = copysign(s.wi.z, wo.z);
  const BsdfEval<F> e = eval_oren_nayar(params, wo, s.wi);
  s.valid = mask_and(MaskOf<F>(wo.z != 0.0f), MaskOf<F>(e.pdf > 0.0f));
  s.weight = e.f * (abs(s.wi.z) / select(s.valid, e.pdf, splat<F>(1.0f)));
  s.pdf = e.pdf;
  s.pdf_reverse = e.pdf_reverse;
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
