#pragma once
// Diffuse base under a dielectric coat without absorption, both sides alike.
//
// Closed form, exact for a smooth coat: light that enters (1 - F(wi)) is scattered by the Lambertian base,
// bounces between base and coat (a geometric series with the internal diffuse reflectance F_in), and leaves
// with (1 - F(wo)) / eta^2:
//   f_d = (1 - F(wo)) (1 - F(wi)) rho / (pi eta^2 (1 - rho F_in))
// plus the coat's own reflection: a delta, or GGX when rough. For a rough coat the transmissions are those of
// the smooth one.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

template <class F>
struct CoatedDiffuse {
  const BsdfParams<F>& params;
  F eta = params.p[3];

  F coat_fresnel(F cosine) const {
    F unused;
    return fresnel_dielectric(cosine, eta, &unused);
  }
  /// f_d without the two transmissions' product.
  Vec3<F> base() const {
    const F inv_eta2 = 1.0f / (eta * eta);
    auto channel = [&](F rho) { return rho * kInvPi * inv_eta2 / (1.0f - rho * params.p[4]); };
    return {channel(params.p[0]), channel(params.p[1]), channel(params.p[2])};
  }
  /// Probability of the coat's lobe, given its Fresnel reflectance at the outgoing direction.
  F coat_probability(F fresnel) const {
    const F rho = max_component(params.rgb(0));
    const F diffuse = (1.0f - fresnel) * rho;
    return fresnel / max(fresnel + diffuse, splat<F>(1e-12f));
  }
};

template <class F, bool kRough>
inline BsdfEval<F> eval_coated(const BsdfParams<F>& params, const Vec3<F>& wo, const Vec3<F>& wi) {
  const CoatedDiffuse<F> coat{params};
  const F co = abs(wo.z), ci = abs(wi.z);
  const F fo = coat.coat_fresnel(co), fi = coat.coat_fresnel(ci);
  const F po = coat.coat_probability(fo), pi = coat.coat_probability(fi);
  BsdfEval<F> e;
  e.f = coat.base() * ((1.0f - fo) * (1.0f - fi));
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
    const F spec = d * ggx.g(wo, wi) * coat.coat_fresnel(abs(dot(wo, m))) / (4.0f * co_safe * ci_safe);
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
  const F fo = coat.coat_fresnel(co);
  const F po = coat.coat_probability(fo);
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
