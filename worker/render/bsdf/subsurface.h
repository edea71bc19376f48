#pragma once
// The boundary of a body that light walks through, as seen from outside (the walk:
// walks/subsurface_walk.h).
//
// T(w) is the part of light along w that gets through the boundary, 1 - F for a smooth one, tabulated for a
// rough one (coated_diffuse.h, without thickness), and T~ = 2 int_0^1 T mu dmu. From outside, light is
// reflected as by a dielectric, or it enters with probability T(w). To the inside the boundary is Lambertian:
//   entering  T(wo) / pi in every direction inside
//   leaving   the part T~ / eta^2 of what meets it from inside, spread by T(wi) / (T~ pi); the rest is
//             reflected diffusely
// Reciprocal, as f(in, out) = f(out, in) / eta^2, and nothing is lost. To leave is to have pbrt's S_w.
//
// A vertex of kSubsurface or kRoughSubsurface is met from outside: it reflects, or a sample enters. To
// reflect has twice the odds that are its due, as a coat's lobe has (coated_diffuse.h): P(w) = T / (2 - T) is
// the probability of entering. A vertex of an exit kind is where a walk ended; it lights and is lit from
// outside only, on the side of `wo`. Their densities are those that mis.h needs on both ends of a walk, whose
// own density is the same both ways:
//   entering  pdf P(wo); pdf_reverse |cos wo| / pi, of leaving along wo
//   leaving   pdf |cos wi| / pi; pdf_reverse P(wi)
#include "worker/render/bsdf/layered/coated_diffuse.h"

namespace lightmill {

/// T above.
template <class F, bool kRough>
inline F entering_share(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& w) {
  const CoatedDiffuse<F, kRough, false, false> coat{params, of_kind};
  return min(coat.side(w).to_base.x, splat<F>(1.0f));
}

/// P above, of T.
template <class F>
inline F entering_probability(F share) {
  return share / (2.0f - share);
}

/// What a rough boundary reflects.
template <class F>
inline BsdfEval<F> eval_subsurface_reflection(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                              const Vec3<F>& wo, const Vec3<F>& wi) {
  const Ggx<F> ggx{params.p[6]};
  const F co = max(abs(wo.z), splat<F>(1e-12f)), ci = max(abs(wi.z), splat<F>(1e-12f));
  const Vec3<F> h = wo + wi;
  const F h2 = dot(h, h);
  const MaskOf<F> valid = mask_and(MaskOf<F>(h2 > 0.0f), same_side(wo, wi));
  const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
  const F d = select(valid, ggx.d(m), F{}) * 0.25f;
  F unused;
  const F reflected = fresnel_dielectric(min(abs(dot(wo, m)), splat<F>(1.0f)), params.p[3], &unused);
  BsdfEval<F> e;
  e.f = splat3<F>(1, 1, 1) * (d * ggx.g(wo, wi) * reflected / (co * ci));
  const auto reflects = [&](const Vec3<F>& w) {
    return 1.0f - entering_probability<F>(entering_share<F, true>(params, of_kind, w));
  };
  e.pdf = reflects(wo) * 4.0f * d * ggx.reflection_density(wo);
  e.pdf_reverse = reflects(wi) * 4.0f * d * ggx.reflection_density(wi);
  return e;
}

/// Reflects or enters; of those that enter wi is the inward normal. Of the smooth kind, to reflect is a delta
/// event.
template <class F, bool kRough>
inline BsdfSample<F> sample_subsurface(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                       F lobe, F u, F v) {
  const F share = entering_share<F, kRough>(params, of_kind, wo), entering = entering_probability<F>(share);
  const MaskOf<F> enters = MaskOf<F>(lobe < entering);
  BsdfSample<F> s;
  s.valid = MaskOf<F>(wo.z != 0.0f);
  s.weight = splat3<F>(1, 1, 1);
  if constexpr (kRough) {
    const Vec3<F> up{wo.x, wo.y, abs(wo.z)};
    const Vec3<F> m = Ggx<F>{params.p[6]}.sample_reflecting(up, u, v);
    s.wi = m * (2.0f * dot(up, m)) - up;
    s.valid = mask_and(s.valid, mask_or(enters, MaskOf<F>(s.wi.z > 0.0f)));
    s.wi.z = copysign(s.wi.z, wo.z);
    const BsdfEval<F> e = eval_subsurface_reflection(params, of_kind, wo, s.wi);
    const MaskOf<F> possible = MaskOf<F>(e.pdf > 0.0f);
    s.valid = mask_and(s.valid, mask_or(enters, possible));
    s.weight = e.f * (abs(s.wi.z) / select(possible, e.pdf, splat<F>(1.0f)));
    s.pdf = e.pdf;
    s.pdf_reverse = e.pdf_reverse;
    s.delta = splat_mask<F>(false);
  } else {
    s.wi = {-wo.x, -wo.y, wo.z};
    s.pdf = s.pdf_reverse = splat<F>(1.0f);
    s.delta = mask_not(enters);
    const F reflected = 1.0f - 0.5f * share;  // (1 - T) / (1 - P)
    s.weight = {reflected, reflected, reflected};
  }
  s.wi = select(enters, Vec3<F>{F{}, F{}, -copysign(splat<F>(1.0f), wo.z)}, s.wi);
  const F entered = 2.0f - share;  // T / P
  s.weight = select(enters, Vec3<F>{entered, entered, entered}, s.weight);
  s.pdf = select(enters, entering, s.pdf);
  s.pdf_reverse = select(enters, abs(wo.z) * kInvPi, s.pdf_reverse);
  return s;
}

/// Of a vertex where light leaves.
template <class F, bool kRough>
inline BsdfEval<F> eval_subsurface_exit(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                        const Vec3<F>& wi) {
  const F one = select(same_side(wo, wi), splat<F>(1.0f), F{});
  const F t = entering_share<F, kRough>(params, of_kind, wi) * one;
  BsdfEval<F> e;
  e.f = splat3<F>(1, 1, 1) * (t * kInvPi / select(of_kind, params.p[4], splat<F>(1.0f)));
  e.pdf = abs(wi.z) * kInvPi * one;
  e.pdf_reverse = entering_probability<F>(t);
  return e;
}

template <class F, bool kRough>
inline BsdfSample<F> sample_subsurface_exit(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                            F u, F v) {
  BsdfSample<F> s;
  s.wi = square_to_cosine_hemisphere(u, v);
  s.pdf = s.wi.z * kInvPi;
  s.wi.z = copysign(s.wi.z, wo.z);
  const F t = entering_share<F, kRough>(params, of_kind, s.wi);
  s.weight = splat3<F>(1, 1, 1) * (t / select(of_kind, params.p[4], splat<F>(1.0f)));
  s.pdf_reverse = entering_probability<F>(t);
  s.valid = MaskOf<F>(t > 0.0f);
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
