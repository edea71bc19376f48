#pragma once
// Diffuse base under a dielectric coat, both sides alike: pbrt's layered model (pbrt-v4 §14.3) in closed
// form.
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
//
// A coat that scatters adds what comes back without having met the base (coat_scattering.h). For the base's
// own light T and R, now per channel, count what gets through the medium by any way; T is tabulated as the
// ratio to 1 - F.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/bsdf/layered/coat_scattering.h"
#include "worker/render/bsdf/tables/albedo_table.h"
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

template <class F, bool kRough, bool kScattering, bool kAnisotropic>
struct CoatedDiffuse {
  const BsdfParams<F>& params;
  MaskOf<F> of_kind;

  /// A direction outside, with what happens at the coat.
  struct Side : CoatSide<F> {
    F reflectance;
    Vec3<F> to_base;  // T
  };

  F fresnel(F cosine) const {
    F unused;
    return fresnel_dielectric(cosine, params.p[3], &unused);
  }
  Side side(const Vec3<F>& w) const {
    Side s;
    s.cosine = abs(w.z);
    F cos_t;
    s.reflectance = fresnel_dielectric(s.cosine, params.p[3], &cos_t);
    const F refracted = max(cos_t, splat<F>(1e-6f));
    if constexpr (kScattering) {
      const F inv = 1.0f / params.p[3];
      s.inside = {w.x * inv, w.y * inv, refracted};
    }
    if constexpr (kRough)
      s.reflectance = fresnel_dielectric(facet_cosine(w, params.p[6]), params.p[3], &cos_t);
    s.transmittance = 1.0f - s.reflectance;
    const IntOf<F> row = table_row(params, 8, of_kind);
    if constexpr (kScattering) {
      const CosinePlace<F> place(s.cosine);
      s.to_base = Vec3<F>{place.in(params.tables, row), place.in(params.tables, row + kCosineNodes),
                          place.in(params.tables, row + 2 * kCosineNodes)} *
                  s.transmittance;
    } else {
      F t = s.transmittance * exp_negative(-params.p[5] / max(cos_t, splat<F>(1e-6f)));
      if constexpr (kRough) t = t * CosinePlace<F>(s.cosine).in(params.tables, row);
      s.to_base = {t, t, t};
    }
    return s;
  }
  CoatScattering<F> scattering() const {
    return {params.tables, table_row(params, 8, of_kind) + 3 * kCosineNodes};
  }
  /// What the base and the medium of the coat scatter.
  Vec3<F> diffuse(const Side& o, const Side& i) const {
    Vec3<F> f = params.rgb(0) * (o.to_base * i.to_base);
    if constexpr (kScattering) f = f + scattering().f(o, i, params.p[3], params.p[5]);
    return f;
  }
  auto lobe() const {
    if constexpr (kAnisotropic) {
      return anisotropic_lobe(params.p[6], scattering().constant(kCoatAnisotropy));
    } else {
      return Ggx<F>{params.p[6]};
    }
  }
  /// Probability of sampling the coat's lobe, by the albedos of the two lobes. The coat's counts twice: lamps
  /// that it mirrors are found by these samples alone, where it is smooth, those that light the base by next
  /// event.
  F coat_probability(const Side& s) const {
    F diffuse = max_component(s.to_base) * params.p[4] * max_component(params.rgb(0)) * kPi;
    if constexpr (kScattering) diffuse = diffuse + s.transmittance * scattering().constant(4);
    const F coat = 2.0f * s.reflectance;
    return coat / max(coat + diffuse, splat<F>(1e-12f));
  }
};

template <class F, bool kRough, bool kScattering, bool kAnisotropic = false>
inline BsdfEval<F> eval_coated(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                               const Vec3<F>& wi) {
  const CoatedDiffuse<F, kRough, kScattering, kAnisotropic> coat{params, of_kind};
  const F co = abs(wo.z), ci = abs(wi.z);
  const auto o = coat.side(wo), i = coat.side(wi);
  const F po = coat.coat_probability(o), pi = coat.coat_probability(i);
  BsdfEval<F> e;
  e.f = coat.diffuse(o, i);
  e.pdf = (1.0f - po) * ci * kInvPi;
  e.pdf_reverse = (1.0f - pi) * co * kInvPi;
  if constexpr (kRough) {
    const auto ggx = coat.lobe();
    const Vec3<F> h = wo + wi;
    const F h2 = dot(h, h);
    const MaskOf<F> valid = MaskOf<F>(h2 > 0.0f);
    const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
    const F d = select(valid, ggx.d(m), F{});
    const F co_safe = max(co, splat<F>(1e-12f)), ci_safe = max(ci, splat<F>(1e-12f));
    const F spec =
        d * ggx.g(wo, wi) * coat.fresnel(min(abs(dot(wo, m)), splat<F>(1.0f))) / (4.0f * co_safe * ci_safe);
    e.f = e.f + Vec3<F>{spec, spec, spec};
    e.pdf = e.pdf + po * d * ggx.reflection_density(wo);
    e.pdf_reverse = e.pdf_reverse + pi * d * ggx.reflection_density(wi);
  }
  const F one = select(same_side(wo, wi), splat<F>(1.0f), F{});
  return {e.f * one, e.pdf * one, e.pdf_reverse * one};
}

template <class F, bool kRough, bool kScattering, bool kAnisotropic = false>
inline BsdfSample<F> sample_coated(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo, F u,
                                   F v) {
  const CoatedDiffuse<F, kRough, kScattering, kAnisotropic> coat{params, of_kind};
  const F co = abs(wo.z);
  const auto o = coat.side(wo);
  const F po = coat.coat_probability(o);
  const MaskOf<F> choose_coat = choose_lobe(po, &u);
  Vec3<F> wi = square_to_cosine_hemisphere(u, v);
  BsdfSample<F> s;
  if constexpr (kRough) {
    const auto ggx = coat.lobe();
    const Vec3<F> up{wo.x, wo.y, co};
    const Vec3<F> m = ggx.sample_reflecting(up, u, v);
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
  const BsdfEval<F> e = eval_coated<F, kRough, kScattering, kAnisotropic>(params, of_kind, wo, s.wi);
  if constexpr (kRough) {
    s.valid = mask_and(s.valid, MaskOf<F>(e.pdf > 0.0f));
  } else {
    s.valid = mask_and(s.valid, mask_or(choose_coat, MaskOf<F>(e.pdf > 0.0f)));
  }
  const F scale = abs(s.wi.z) / select(MaskOf<F>(e.pdf > 0.0f), e.pdf, splat<F>(1.0f));
  const F coat_weight = o.reflectance / max(po, splat<F>(1e-12f));
  s.weight = select(s.delta, Vec3<F>{coat_weight, coat_weight, coat_weight}, e.f * scale);
  s.pdf = select(s.delta, splat<F>(1.0f), e.pdf);
  s.pdf_reverse = select(s.delta, splat<F>(1.0f), e.pdf_reverse);
  return s;
}

}  // namespace lightmill
