#pragma once
// Diffuse base under a dielectric coat, both sides alike: pbrt's layered model (pbrt-v4 §14.3) without
// scattering inside the coat, in closed form.
//
// For a smooth coat this is exact. T(w) = (1 - F(w)) exp(-t / mu') is what enters (or leaves) along w, with
// mu' the cosine of the refracted direction and t the coat's thickness. The Lambertian base, of reflectance
// rho, and the coat's inside exchange light; one round trip keeps rho R, with
//   R = 2 int_0^1 F_in(mu) exp(-2 t / mu) mu dmu
// the mean internal reflectance of diffuse light. After at most n encounters with the base
//   f_d = T(wo) T(wi) B,   B = rho / (pi eta^2) * (1 - (rho R)^n) / (1 - rho R)
// plus the coat's own reflection, a delta. Reciprocal by form; its energy is at most 1.
//
// A rough coat (GGX) keeps this form, as a Lambertian base forgets where light came from: T(w) becomes the
// part of light along w that gets through the rough interface to the base, and R what that interface returns,
// both integrals over it (layered_walk.h). T is tabulated over the cosine (albedo_table.h) as the ratio to
// the smooth T at the mean facet_cosine.
#include "worker/render/bsdf/albedo_table.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/math/exp.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

/// Constants of a coat, by quadrature in double.
struct CoatConstants {
  double internal_reflectance;    // R above
  double entering_transmittance;  // 2 int T(mu) mu dmu: of diffuse light from outside
};
CoatConstants coat_constants(double eta, double thickness);
/// The same for a coat of roughness `alpha` > kSmoothAlpha, and T's row.
CoatConstants rough_coat_constants(float eta, float thickness, float alpha, CosineRow* row);

/// B above for one channel.
float coated_base(float rho, double eta, double internal_reflectance, int base_encounters);

template <class F, bool kRough>
struct CoatedDiffuse {
  const BsdfParams<F>& params;
  MaskOf<F> of_kind;

  F fresnel(F cosine) const {
    F unused;
    return fresnel_dielectric(cosine, params.p[3], &unused);
  }
  /// T and F of `w`.
  F transmittance(const Vec3<F>& w, F* reflectance) const {
    F cos_t;
    const F cosine = abs(w.z);
    *reflectance = fresnel_dielectric(kRough ? facet_cosine(w, params.p[6]) : cosine, params.p[3], &cos_t);
    const F t = (1.0f - *reflectance) * exp_negative(-params.p[5] / max(cos_t, splat<F>(1e-6f)));
    if constexpr (kRough) return t * CosinePlace<F>(cosine).in(params.tables, table_row(params, 8, of_kind));
    return t;
  }
  /// Probability of sampling the coat's lobe, by the albedos of the two lobes.
  F coat_probability(F reflectance, F transmitted) const {
    const F diffuse = transmitted * params.p[4] * max_component(params.rgb(0)) * kPi;
    return reflectance / max(reflectance + diffuse, splat<F>(1e-12f));
  }
};

template <class F, bool kRough>
inline BsdfEval<F> eval_coated(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                               const Vec3<F>& wi) {
  const CoatedDiffuse<F, kRough> coat{params, of_kind};
  const F co = abs(wo.z), ci = abs(wi.z);
  F fo, fi;
  const F to = coat.transmittance(wo, &fo), ti = coat.transmittance(wi, &fi);
  const F po = coat.coat_probability(fo, to), pi = coat.coat_probability(fi, ti);
  BsdfEval<F> e;
  e.f = params.rgb(0) * (to * ti);
  e.pdf = (1.0f - po) * ci * kInvPi;
  e.pdf_reverse = (1.0f - pi) * co * kInvPi;
  if constexpr (kRough) {
    const Ggx<F> ggx{params.p[6]};
    const Vec3<F> h = wo + wi;
    const F h2 = dot(h, h);
    const MaskOf<F> valid = MaskOf<F>(h2 > 0.0f);
    const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
    const F d = select(valid, ggx.d(m), F{});
    const F co_safe = max(co, splat<F>(1e-12f)), ci_safe = max(ci, splat<F>(1e-12f));
    const F spec =
        d * ggx.g(wo, wi) * coat.fresnel(min(abs(dot(wo, m)), splat<F>(1.0f))) / (4.0f * co_safe * ci_safe);
    e.f = e.f + Vec3<F>{spec, spec, spec};
    e.pdf = e.pdf + po * d * ggx.g1(wo) / (4.0f * co_safe);
    e.pdf_reverse = e.pdf_reverse + pi * d * ggx.g1(wi) / (4.0f * ci_safe);
  }
  const F one = select(same_side(wo, wi), splat<F>(1.0f), F{});
  return {e.f * one, e.pdf * one, e.pdf_reverse * one};
}

template <class F, bool kRough>
inline BsdfSample<F> sample_coated(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo, F lobe,
                                   F u, F v) {
  const CoatedDiffuse<F, kRough> coat{params, of_kind};
  const F co = abs(wo.z);
  F fo;
  const F to = coat.transmittance(wo, &fo);
  const F po = coat.coat_probability(fo, to);
  const MaskOf<F> choose_coat = MaskOf<F>(lobe < po);
  Vec3<F> wi = square_to_cosine_hemisphere(u, v);
  BsdfSample<F> s;
  if constexpr (kRough) {
    const Ggx<F> ggx{params.p[6]};
    const Vec3<F> up{wo.x, wo.y, co};
    const Vec3<F> m = ggx.sample_visible(up, u, v);
    wi = select(choose_coat, m * (2.0f * dot(up, m)) - up, wi);
    s.valid = mask_and(MaskOf<F>(wi.z > 0.0f), MaskOf<F>(co > 0.0f));
    s.delta = splat_mask<F>(false);
    wi.z = copysign(wi.z, wo.z);
    s.wi = wi;
  } else {
    wi.z = copysign(wi.z, wo.z);
    s.wi = select(choose_coat, Vec3<F>{-wo.x, -wo.y, wo.z}, wi);
    s.valid = MaskOf<F>(co > 0.0f);
    s.delta = choose_coat;
  }
  const BsdfEval<F> e = eval_coated<F, kRough>(params, of_kind, wo, s.wi);
  if constexpr (kRough) {
    s.valid = mask_and(s.valid, MaskOf<F>(e.pdf > 0.0f));
  } else {
    s.valid = mask_and(s.valid, mask_or(choose_coat, MaskOf<F>(e.pdf > 0.0f)));
  }
  const F scale = abs(s.wi.z) / select(MaskOf<F>(e.pdf > 0.0f), e.pdf, splat<F>(1.0f));
  const F coat_weight = fo / max(po, splat<F>(1e-12f));
  s.weight = select(s.delta, Vec3<F>{coat_weight, coat_weight, coat_weight}, e.f * scale);
  s.pdf = select(s.delta, splat<F>(1.0f), e.pdf);
  s.pdf_reverse = select(s.delta, splat<F>(1.0f), e.pdf_reverse);
  return s;
}

}  // namespace lightmill
