#pragma once
// glTF's transmission: interfaces that tint what they let through, each time it passes.
//
// Refracting ones are those of dielectric.h; rough, they lose what one bounce between facets leaves. A sheet
// is too thin to refract: light goes on in the direction in which it came, spread as its reflection is, so
// both lobes are one GGX lobe of albedo 1 (its energy compensated, metallic_table.h) split by the Fresnel
// reflectance of one interface, the passing part mirrored to the other side. Parameters: 0 eta, 1-3 tint, 6
// alpha; the metallic table is where the tables begin.
#include "worker/render/bsdf/dielectric.h"
#include "worker/render/bsdf/tables/metallic_table.h"

namespace lightmill {

namespace tinted_detail {
/// `weight`, tinted where light passes.
template <class F>
inline Vec3<F> tint_passing(const BsdfParams<F>& params, const Vec3<F>& wo, const Vec3<F>& wi,
                            const Vec3<F>& weight) {
  const Vec3<F> tint = params.rgb(1);
  return select(same_side(wo, wi), weight, Vec3<F>{weight.x * tint.x, weight.y * tint.y, weight.z * tint.z});
}
}  // namespace tinted_detail

template <class F>
inline BsdfSample<F> sample_tinted_dielectric(const BsdfParams<F>& params, const Vec3<F>& wo, F lobe,
                                              Mode mode) {
  BsdfSample<F> s = sample_smooth_dielectric(params, wo, lobe, mode);
  s.weight = tinted_detail::tint_passing(params, wo, s.wi, s.weight);
  return s;
}

template <class F>
inline BsdfEval<F> eval_rough_tinted_dielectric(const BsdfParams<F>& params, const Vec3<F>& wo,
                                                const Vec3<F>& wi, Mode mode) {
  BsdfEval<F> e = eval_rough_dielectric(Ggx<F>{params.p[6]}, params, wo, wi, mode);
  e.f = tinted_detail::tint_passing(params, wo, wi, e.f);
  return e;
}

template <class F>
inline BsdfSample<F> sample_rough_tinted_dielectric(const BsdfParams<F>& params, const Vec3<F>& wo, F lobe,
                                                    F u, F v, Mode mode) {
  BsdfSample<F> s = sample_rough_dielectric(Ggx<F>{params.p[6]}, params, wo, lobe, u, v, mode);
  s.weight = tinted_detail::tint_passing(params, wo, s.wi, s.weight);
  return s;
}

template <class F>
inline BsdfSample<F> sample_tinted_sheet(const BsdfParams<F>& params, const Vec3<F>& wo, F lobe) {
  F unused;
  const F r = fresnel_dielectric(abs(wo.z), params.p[0], &unused);
  const MaskOf<F> reflect = MaskOf<F>(lobe < r);
  BsdfSample<F> s;
  s.wi = select(reflect, Vec3<F>{-wo.x, -wo.y, wo.z}, -wo);
  const F one = splat<F>(1.0f);
  s.weight = tinted_detail::tint_passing(params, wo, s.wi, {one, one, one});
  s.pdf = s.pdf_reverse = one;
  s.valid = MaskOf<F>(wo.z != 0.0f);
  s.delta = splat_mask<F>(true);
  return s;
}

template <class F>
inline BsdfEval<F> eval_rough_tinted_sheet(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                           const Vec3<F>& wi) {
  const MaskOf<F> reflect = same_side(wo, wi);
  const Vec3<F> mirrored{wi.x, wi.y, copysign(wi.z, wo.z)};
  const Vec3<F> h = wo + mirrored;
  const F h2 = dot(h, h);
  const MaskOf<F> valid = mask_and(MaskOf<F>(h2 > 0.0f), MaskOf<F>(wo.z * wi.z != 0.0f));
  const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
  const Ggx<F> ggx{select(of_kind, params.p[6], splat<F>(1.0f))};
  const F co = max(abs(wo.z), splat<F>(1e-12f)), ci = max(abs(wi.z), splat<F>(1e-12f));
  F unused;
  const F r = fresnel_dielectric(min(abs(dot(wo, m)), splat<F>(1.0f)), params.p[0], &unused);
  const F share = select(reflect, r, 1.0f - r);
  const F d = select(valid, ggx.d(m), F{}) * share;
  const F g = LobeAlbedo<F>(params.tables, co, ggx.alpha).g * LobeAlbedo<F>(params.tables, ci, ggx.alpha).g;
  const F f = d * ggx.g(wo, mirrored) * g / (4.0f * co * ci);
  return {tinted_detail::tint_passing(params, wo, wi, {f, f, f}), d * ggx.g1(wo) / (4.0f * co),
          d * ggx.g1(mirrored) / (4.0f * ci)};
}

template <class F>
inline BsdfSample<F> sample_rough_tinted_sheet(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                               const Vec3<F>& wo, F lobe, F u, F v) {
  const Ggx<F> ggx{select(of_kind, params.p[6], splat<F>(1.0f))};
  const Vec3<F> up{wo.x, wo.y, abs(wo.z)};
  const Vec3<F> m = ggx.sample_visible(up, u, v);
  Vec3<F> wi = m * (2.0f * dot(up, m)) - up;
  F unused;
  const F r = fresnel_dielectric(min(abs(dot(up, m)), splat<F>(1.0f)), params.p[0], &unused);
  BsdfSample<F> s;
  s.valid = mask_and(MaskOf<F>(wi.z > 0.0f), MaskOf<F>(up.z > 0.0f));
  wi.z = select(MaskOf<F>(lobe < r), copysign(wi.z, wo.z), -copysign(wi.z, wo.z));
  s.wi = wi;
  const BsdfEval<F> e = eval_rough_tinted_sheet(params, of_kind, wo, wi);
  s.valid = mask_and(s.valid, MaskOf<F>(e.pdf > 0.0f));
  s.weight = e.f * (abs(wi.z) / select(s.valid, e.pdf, splat<F>(1.0f)));
  s.pdf = e.pdf;
  s.pdf_reverse = e.pdf_reverse;
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
