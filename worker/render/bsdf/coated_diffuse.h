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
// plus the coat's own reflection: a delta, or GGX when rough. For a rough coat the transmissions are those of
// the smooth one. Reciprocal by form; its energy is at most 1.
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

/// B above for one channel.
float coated_base(float rho, double eta, double internal_reflectance, int base_encounters);

template <class F>
struct CoatedDiffuse {
  const BsdfParams<F>& params;

  F fresnel(F cosine) const {
    F unused;
    return fresnel_dielectric(cosine, params.p[3], &unused);
  }
  /// T and F at outside cosine `cosine`.
  F transmittance(F cosine, F* reflectance) const {
    F cos_t;
    *reflectance = fresnel_dielectric(cosine, params.p[3], &cos_t);
    return (1.0f - *reflectance) * exp_negative(-params.p[5] / max(cos_t, splat<F>(1e-6f)));
  }
  /// Probability of sampling the coat's lobe, by the albedos of the two lobes.
  F coat_probability(F reflectance, F transmitted) const {
    const F diffuse = transmitted * params.p[4] * max_component(params.rgb(0)) * kPi;
    return reflectance / max(reflectance + diffuse, splat<F>(1e-12f));
  }
};

template <class F, bool kRough>
inline BsdfEval<F> eval_coated(const BsdfParams<F>& params, const Vec3<F>& wo, const Vec3<F>& wi) {
  const CoatedDiffuse<F> coat{params};
  const F co = abs(wo.z), ci = abs(wi.z);
  F fo, fi;
  const F to = coat.transmittance(co, &fo), ti = coat.transmittance(ci, &fi);
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
inline BsdfSample<F> sample_coated(const BsdfParams<F>& params, const Vec3<F>& wo, F lobe, F u, F v) {
  const CoatedDiffuse<F> coat{params};
  const F co = abs(wo.z);
  F fo;
  const F to = coat.transmittance(co, &fo);
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
  const BsdfEval<F> e = eval_coated<F, kRough>(params, wo, s.wi);
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
