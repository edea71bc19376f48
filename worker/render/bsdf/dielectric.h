#pragma once
// Smooth and rough dielectric interfaces. The shading normal points to the outside (index 1); params.p[0]
// is the index of the inside. Rough: Walter et al. 2007 with the generalised half vector.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"

namespace lightmill {

/// Index on the far side over the index on the side of `w`.
template <class F>
inline F relative_eta(F eta, const Vec3<F>& w) {
  return select(MaskOf<F>(w.z > 0.0f), eta, 1.0f / eta);
}

/// `lobe` chooses between reflection and transmission with the Fresnel reflectance.
template <class F>
inline BsdfSample<F> sample_smooth_dielectric(const BsdfParams<F>& params, const Vec3<F>& wo, F lobe,
                                              Mode mode) {
  const F eta = relative_eta(params.p[0], wo);
  F cos_t;
  const F r = fresnel_dielectric(abs(wo.z), eta, &cos_t);
  const MaskOf<F> reflect = MaskOf<F>(lobe < r);
  const F inv = 1.0f / eta;
  BsdfSample<F> s;
  s.wi =
      select(reflect, Vec3<F>{-wo.x, -wo.y, wo.z}, Vec3<F>{-wo.x * inv, -wo.y * inv, -copysign(cos_t, wo.z)});
  const F scale = mode == Mode::kRadiance ? select(reflect, splat<F>(1.0f), inv * inv) : splat<F>(1.0f);
  s.weight = {scale, scale, scale};
  s.roulette_scale = 1.0f / scale;
  s.pdf = s.pdf_reverse = splat<F>(1.0f);
  s.valid = mask_and(MaskOf<F>(wo.z != 0.0f), MaskOf<F>(s.wi.z != 0.0f));
  s.delta = splat_mask<F>(true);
  return s;
}

/// `ggx` is a Ggx or AnisotropicGgx.
template <class F, class Distribution>
inline BsdfEval<F> eval_rough_dielectric(const Distribution& ggx, const BsdfParams<F>& params,
                                         const Vec3<F>& wo, const Vec3<F>& wi, Mode mode) {
  const MaskOf<F> reflect = same_side(wo, wi);
  const F eta_o = relative_eta(params.p[0], wo);  // n(wi side) / n(wo side) when transmitting
  const F eta = select(reflect, splat<F>(1.0f), eta_o);
  Vec3<F> h = wi * eta + wo;
  const F h2 = dot(h, h);
  MaskOf<F> valid = mask_and(MaskOf<F>(h2 > 0.0f), MaskOf<F>(wo.z * wi.z != 0.0f));
  h = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
  h = h * copysign(splat<F>(1.0f), h.z);
  const F oh = dot(wo, h), ih = dot(wi, h);
  valid = mask_and(valid, mask_and(MaskOf<F>(oh * wo.z > 0.0f), MaskOf<F>(ih * wi.z > 0.0f)));
  F unused;
  const F r = fresnel_dielectric(abs(oh), eta_o, &unused);
  const F d = select(valid, ggx.d(h), F{});
  const F co = max(abs(wo.z), splat<F>(1e-12f)), ci = max(abs(wi.z), splat<F>(1e-12f));
  const F g = ggx.g(wo, wi);
  // Reflection.
  const F f_reflect = d * g * r / (4.0f * co * ci);
  const F pdf_reflect = d * ggx.g1(wo) * r / (4.0f * co);
  const F pdf_reflect_reverse = d * ggx.g1(wi) * r / (4.0f * ci);
  // Transmission. dh/dwi = |dot(wi, h)| / (dot(wi, h) + dot(wo, h) / eta)^2, and the same with wo and wi
  // exchanged (eta -> 1/eta).
  const F q = ih + oh / eta;
  const F denominator = max(q * q, splat<F>(1e-30f));
  const F q_reverse = oh + ih * eta;
  const F denominator_reverse = max(q_reverse * q_reverse, splat<F>(1e-30f));
  const F t = 1.0f - r;
  F f_transmit = d * g * t * abs(ih * oh) / (co * ci * denominator);
  if (mode == Mode::kRadiance) f_transmit = f_transmit / (eta * eta);
  const F pdf_transmit = d * ggx.g1(wo) * abs(oh) / co * t * abs(ih) / denominator;
  const F pdf_transmit_reverse = d * ggx.g1(wi) * abs(ih) / ci * t * abs(oh) / denominator_reverse;
  const F f = select(reflect, f_reflect, f_transmit);
  return {{f, f, f},
          select(reflect, pdf_reflect, pdf_transmit),
          select(reflect, pdf_reflect_reverse, pdf_transmit_reverse)};
}

template <class F, class Distribution>
inline BsdfSample<F> sample_rough_dielectric(const Distribution& ggx, const BsdfParams<F>& params,
                                             const Vec3<F>& wo, F lobe, F u, F v, Mode mode) {
  const F flip = copysign(splat<F>(1.0f), wo.z);
  const Vec3<F> up = wo * flip;  // rotate by pi rather than mirror: GGX is symmetric under it
  const Vec3<F> m = ggx.sample_visible(up, u, v);
  const F c = dot(up, m);
  const F eta = relative_eta(params.p[0], wo);
  F cos_t;
  const F r = fresnel_dielectric(abs(c), eta, &cos_t);
  const MaskOf<F> reflect = MaskOf<F>(lobe < r);
  const F inv = 1.0f / eta;
  const Vec3<F> reflected = m * (2.0f * c) - up;
  const Vec3<F> transmitted = m * (c * inv - cos_t) - up * inv;
  BsdfSample<F> s;
  const Vec3<F> wi = select(reflect, reflected, transmitted);
  s.wi = wi * flip;
  s.valid = mask_and(MaskOf<F>(up.z > 0.0f), MaskOf<F>(select(reflect, wi.z, -wi.z) > 0.0f));
  const BsdfEval<F> e = eval_rough_dielectric(ggx, params, wo, s.wi, mode);
  s.pdf = e.pdf;
  s.pdf_reverse = e.pdf_reverse;
  s.valid = mask_and(s.valid, MaskOf<F>(e.pdf > 0.0f));
  const F scale = abs(s.wi.z) / select(s.valid, e.pdf, splat<F>(1.0f));
  s.weight = e.f * scale;
  if (mode == Mode::kRadiance) s.roulette_scale = select(reflect, splat<F>(1.0f), eta * eta);
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
