#pragma once
// Lambertian reflection on both sides.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

template <class F>
inline BsdfEval<F> eval_diffuse(const BsdfParams<F>& params, const Vec3<F>& wo, const Vec3<F>& wi) {
  const MaskOf<F> reflects = same_side(wo, wi);
  const F one = select(reflects, splat<F>(1.0f), F{});
  return {params.rgb(0) * (one * kInvPi), one * abs(wi.z) * kInvPi, one * abs(wo.z) * kInvPi};
}

template <class F>
inline BsdfSample<F> sample_diffuse(const BsdfParams<F>& params, const Vec3<F>& wo, F u, F v) {
  BsdfSample<F> s;
  s.wi = square_to_cosine_hemisphere(u, v);
  s.wi.z = copysign(s.wi.z, wo.z);
  s.weight = params.rgb(0);
  s.pdf = abs(s.wi.z) * kInvPi;
  s.pdf_reverse = abs(wo.z) * kInvPi;
  s.valid = MaskOf<F>(wo.z != 0.0f);
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
