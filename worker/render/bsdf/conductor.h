#pragma once
// Smooth and rough metals, reflecting on both sides.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"

namespace lightmill {

template <class F>
inline BsdfSample<F> sample_smooth_conductor(const BsdfParams<F>& params, const Vec3<F>& wo) {
  BsdfSample<F> s;
  s.wi = {-wo.x, -wo.y, wo.z};
  s.weight = fresnel_conductor(abs(wo.z), params.rgb(0), params.rgb(3));
  s.pdf = s.pdf_reverse = splat<F>(1.0f);
  s.valid = MaskOf<F>(wo.z != 0.0f);
  s.delta = splat_mask<F>(true);
  return s;
}

template <class F>
inline BsdfEval<F> eval_rough_conductor(const BsdfParams<F>& params, const Vec3<F>& wo, const Vec3<F>& wi) {
  const Ggx<F> ggx{params.p[6]};
  const Vec3<F> h = wo + wi;
  const F h2 = dot(h, h);
  const MaskOf<F> valid = mask_and(same_side(wo, wi), MaskOf<F>(h2 > 0.0f));
  const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
  const F co = max(abs(wo.z), splat<F>(1e-12f)), ci = max(abs(wi.z), splat<F>(1e-12f));
  const F d = select(valid, ggx.d(m), F{});
  BsdfEval<F> e;
  e.f = fresnel_conductor(abs(dot(wo, m)), params.rgb(0), params.rgb(3)) *
        (d * ggx.g(wo, wi) / (4.0f * co * ci));
  e.pdf = d * ggx.g1(wo) / (4.0f * co);
  e.pdf_reverse = d * ggx.g1(wi) / (4.0f * ci);
  return e;
}

template <class F>
inline BsdfSample<F> sample_rough_conductor(const BsdfParams<F>& params, const Vec3<F>& wo, F u, F v) {
  const Ggx<F> ggx{params.p[6]};
  const Vec3<F> up{wo.x, wo.y, abs(wo.z)};
  const Vec3<F> m = ggx.sample_visible(up, u, v);
  const F c = dot(up, m);
  Vec3<F> wi = m * (2.0f * c) - up;
  BsdfSample<F> s;
  s.valid = mask_and(MaskOf<F>(wi.z > 0.0f), MaskOf<F>(up.z > 0.0f));
  const F d = ggx.d(m);
  const F g1_o = ggx.g1(up);
  s.pdf = d * g1_o / (4.0f * max(up.z, splat<F>(1e-12f)));
  s.pdf_reverse = d * ggx.g1(wi) / (4.0f * max(wi.z, splat<F>(1e-12f)));
  s.weight = fresnel_conductor(abs(c), params.rgb(0), params.rgb(3)) * (ggx.g(up, wi) / g1_o);
  wi.z = copysign(wi.z, wo.z);
  s.wi = wi;
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
