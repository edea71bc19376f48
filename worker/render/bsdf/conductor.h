#pragma once
// Smooth and rough metals, reflecting on both sides.
//
// Light that one bounce leaves among the facets is lost, up to half of it for alpha = 1. With energy
// compensation the lobe is scaled by 1 + F0 (g(wo) g(wi) - 1) per channel, where the row g (albedo_table.h)
// makes a metal that reflects everything white in every direction: reciprocal, positive, and sampled as
// before. The factor F0 stands for the further bounces' reflectance (Turquin, "Practical multiple scattering
// compensation for microfacet models", 2019, whose scale depends on wo alone and is not reciprocal).
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/bsdf/tables/albedo_table.h"

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

/// The row g for roughness `alpha`.
CosineRow compensation_row(float alpha);

/// What the reflectance is scaled by; cosines outside. Lanes without a row: 1.
template <class F>
inline Vec3<F> compensate(const Vec3<F>& reflectance, const BsdfParams<F>& params, MaskOf<F> of_kind, F co,
                          F ci) {
  const MaskOf<F> on = mask_and(of_kind, MaskOf<F>(params.p[7] > 0.0f));
  if (!any(on)) return reflectance;
  const IntOf<F> row = to_int(select(on, params.p[7] - 1.0f, F{}));
  const F gain = select(
      on, CosinePlace<F>(co).in(params.tables, row) * CosinePlace<F>(ci).in(params.tables, row) - 1.0f, F{});
  const Vec3<F> f0 = fresnel_conductor(splat<F>(1.0f), params.rgb(0), params.rgb(3));
  return reflectance + reflectance * f0 * gain;
}

/// `ggx` is a Ggx or AnisotropicGgx.
template <class F, class Distribution>
inline BsdfEval<F> eval_rough_conductor(const Distribution& ggx, const BsdfParams<F>& params,
                                        MaskOf<F> of_kind, const Vec3<F>& wo, const Vec3<F>& wi) {
  const Vec3<F> h = wo + wi;
  const F h2 = dot(h, h);
  const MaskOf<F> valid = mask_and(same_side(wo, wi), MaskOf<F>(h2 > 0.0f));
  const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
  const F co = max(abs(wo.z), splat<F>(1e-12f)), ci = max(abs(wi.z), splat<F>(1e-12f));
  const F d = select(valid, ggx.d(m), F{});
  BsdfEval<F> e;
  e.f =
      compensate(fresnel_conductor(abs(dot(wo, m)), params.rgb(0), params.rgb(3)), params, of_kind, co, ci) *
      (d * ggx.g(wo, wi) / (4.0f * co * ci));
  e.pdf = d * ggx.reflection_density(wo);
  e.pdf_reverse = d * ggx.reflection_density(wi);
  return e;
}

template <class F, class Distribution>
inline BsdfSample<F> sample_rough_conductor(const Distribution& ggx, const BsdfParams<F>& params,
                                            MaskOf<F> of_kind, const Vec3<F>& wo, F u, F v) {
  const Vec3<F> up{wo.x, wo.y, abs(wo.z)};
  const Vec3<F> m = ggx.sample_reflecting(up, u, v);
  const F c = dot(up, m);
  Vec3<F> wi = m * (2.0f * c) - up;
  BsdfSample<F> s;
  s.valid = mask_and(MaskOf<F>(wi.z > 0.0f), MaskOf<F>(up.z > 0.0f));
  const F d = ggx.d(m);
  const F density = ggx.reflection_density(up);
  s.pdf = d * density;
  s.pdf_reverse = d * ggx.reflection_density(wi);
  s.weight =
      compensate(fresnel_conductor(abs(c), params.rgb(0), params.rgb(3)), params, of_kind, up.z, wi.z) *
      (ggx.g(up, wi) / (4.0f * max(up.z, splat<F>(1e-12f)) * density));
  wi.z = copysign(wi.z, wo.z);
  s.wi = wi;
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
