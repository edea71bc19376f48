#pragma once
// Blender's Glass and Refraction BSDFs, and the glass of its Principled BSDF, as Cycles 3.4 has them. The
// shading normal points to the outside (index 1).
//
// Reflection and refraction are two lobes, weighed by a dielectric's Fresnel term F over <wo, n>, not over
// <wo, m>; each has facets of its own (facets.h) and a colour. A Refraction BSDF has F = 0: what would be
// reflected in full is black. Radiance is not scaled by 1/eta^2 where it enters a body.
//
// Where F is 1 on one side, no path from there is refracted, while paths from the other side may come out
// there: they alone find such light.
//
// So f is neither reciprocal nor an interface's. That of a path from the light is f with its directions
// exchanged: for smooth glass, refracted importance is scaled by 1/eta^2, as radiance is elsewhere.
//
// Parameters: 0 index of the inside, 1-3 colour of what is refracted, 4 how what is reflected is coloured
// (kGlass...; from 0 up: a Principled BSDF's specular tint), 5 distribution (facets.h), 6 alpha of the
// reflection, 7 of the refraction.
#include "worker/render/bsdf/blender/facets.h"
#include "worker/render/bsdf/blender/principled.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/dielectric.h"

namespace lightmill {

/// The same colour as what is refracted; nothing is reflected; all is (a mirror).
inline constexpr float kGlassOneColour = -1, kGlassRefractsAlone = -2, kGlassReflectsAlone = -3;

/// Weight of the reflection, F above.
template <class F>
inline F glass_reflects(const BsdfParams<F>& params, const Vec3<F>& wo) {
  F unused;
  const F r = fresnel_dielectric(min(abs(wo.z), splat<F>(1.0f)), relative_eta(params.p[0], wo), &unused);
  const F given = select(MaskOf<F>(params.p[4] < kGlassReflectsAlone + 0.5f), splat<F>(1.0f), F{});
  return select(MaskOf<F>(params.p[4] < kGlassRefractsAlone + 0.5f), given, r);
}

/// Probability with which reflection is sampled, F^(3/4): more than its weight, as a window's reflection of
/// the sky is often much brighter than the room behind it.
template <class F>
inline F glass_reflection_chance(F weight) {
  return sqrt(weight * sqrt(weight));
}

/// Colour of what a facet reflects that is met at `cosine`.
template <class F>
inline Vec3<F> glass_reflected_colour(const BsdfParams<F>& params, F cosine) {
  const MaskOf<F> one_colour = MaskOf<F>(params.p[4] < kGlassOneColour + 0.5f);
  const F index = max(params.p[0], 1.0f / params.p[0]);
  const F whiter = StretchedFresnel<F>(max(index, splat<F>(1.0f + 1e-4f)))(cosine);
  const F tint = select(one_colour, splat<F>(1.0f), params.p[4] * (1.0f - whiter));
  const auto channel = [&](F c) { return 1.0f + (c - 1.0f) * tint; };
  return {channel(params.p[1]), channel(params.p[2]), channel(params.p[3])};
}

template <class F>
inline BsdfSample<F> sample_sharp_glass(const BsdfParams<F>& params, const Vec3<F>& wo, F lobe, Mode mode) {
  const F eta = relative_eta(params.p[0], wo), inv = 1.0f / eta;
  const F weight = glass_reflects(params, wo), p = glass_reflection_chance(weight);
  F cos_t;
  const F whole = fresnel_dielectric(min(abs(wo.z), splat<F>(1.0f)), eta, &cos_t);
  const MaskOf<F> reflect = MaskOf<F>(lobe < p);
  BsdfSample<F> s;
  s.wi =
      select(reflect, Vec3<F>{-wo.x, -wo.y, wo.z}, Vec3<F>{-wo.x * inv, -wo.y * inv, -copysign(cos_t, wo.z)});
  const F scale = mode == Mode::kRadiance ? splat<F>(1.0f) : select(reflect, splat<F>(1.0f), inv * inv);
  const F of_refraction = (1.0f - weight) / max(1.0f - p, splat<F>(1e-12f));
  const F over_chance = select(reflect, weight / max(p, splat<F>(1e-12f)), of_refraction);
  s.weight =
      select(reflect, glass_reflected_colour(params, abs(wo.z)), params.rgb(1)) * (scale * over_chance);
  s.roulette_scale = 1.0f / scale;
  s.pdf = s.pdf_reverse = splat<F>(1.0f);
  const MaskOf<F> refracts = mask_and(MaskOf<F>(whole < 1.0f), MaskOf<F>(cos_t > 0.0f));
  s.valid = mask_and(MaskOf<F>(wo.z != 0.0f), mask_or(reflect, refracts));
  s.delta = splat_mask<F>(true);
  return s;
}

template <class F>
class RoughGlass {
 public:
  RoughGlass(const BsdfParams<F>& params, MaskOf<F> of_kind) : params_(params) {
    params_.p[0] = select(of_kind, params.p[0], splat<F>(1.5f));
    params_.p[4] = select(of_kind, params.p[4], splat<F>(kGlassOneColour));
    const auto facets = [&](int slot) {
      const F alpha = max(select(of_kind, params.p[slot], splat<F>(1.0f)), splat<F>(kSmoothAlpha));
      return BlenderFacets<F>{{alpha, alpha}, select(of_kind, params.p[5], F{})};
    };
    reflecting_ = facets(6);
    refracting_ = facets(7);
  }

  BsdfEval<F> eval(const Vec3<F>& wo, const Vec3<F>& wi, Mode mode) const {
    const MaskOf<F> reflect = same_side(wo, wi);
    const F eta_o = relative_eta(params_.p[0], wo);  // n(wi side) / n(wo side) when transmitting
    const F eta = select(reflect, splat<F>(1.0f), eta_o);
    Vec3<F> h = wi * eta + wo;
    const F h2 = dot(h, h);
    MaskOf<F> valid = mask_and(MaskOf<F>(h2 > 1e-12f), MaskOf<F>(wo.z * wi.z != 0.0f));
    h = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
    h = h * copysign(splat<F>(1.0f), h.z);
    const F oh = dot(wo, h), ih = dot(wi, h);
    valid = mask_and(valid, mask_and(MaskOf<F>(oh * wo.z > 0.0f), MaskOf<F>(ih * wi.z > 0.0f)));
    const F co = max(abs(wo.z), splat<F>(1e-6f)), ci = max(abs(wi.z), splat<F>(1e-6f));
    const F fo = glass_reflects(params_, wo), fi = glass_reflects(params_, wi);
    const bool radiance = mode == Mode::kRadiance;
    const F weight = radiance ? fo : fi;
    const F d = select(reflect, reflecting_.ggx.d(h), refracting_.ggx.d(h));
    const F g_o = select(reflect, reflecting_.ggx.g1(wo), refracting_.ggx.g1(wo));
    const F g_i = select(reflect, reflecting_.ggx.g1(wi), refracting_.ggx.g1(wi));
    const F density =
        select(reflect, reflecting_.density(h, wo, wi), refracting_.density(h, wo, wi)) / (co * ci);
    // dh/dwi of refraction, and the same with wo and wi exchanged.
    const F q = ih + oh / eta, q_reverse = oh + ih * eta;
    const F jacobian = abs(ih) / max(q * q, splat<F>(1e-20f)),
            jacobian_reverse = abs(oh) / max(q_reverse * q_reverse, splat<F>(1e-20f));
    F through = (1.0f - weight) * density * abs(oh) * jacobian;
    if (!radiance) through = through / (eta * eta);
    const Vec3<F> reflected =
        glass_reflected_colour(params_, min(abs(oh), splat<F>(1.0f))) * (weight * density * 0.25f);
    const F one = select(valid, splat<F>(1.0f), F{});
    const F po = glass_reflection_chance(fo), pi = glass_reflection_chance(fi);
    BsdfEval<F> e;
    e.f = select(reflect, reflected, params_.rgb(1) * through) * one;
    e.pdf = select(reflect, po * d * g_o * 0.25f / co, (1.0f - po) * d * g_o * abs(oh) / co * jacobian) * one;
    e.pdf_reverse =
        select(reflect, pi * d * g_i * 0.25f / ci, (1.0f - pi) * d * g_i * abs(ih) / ci * jacobian_reverse) *
        one;
    return e;
  }

  BsdfSample<F> sample(const Vec3<F>& wo, F u, F v, Mode mode) const {
    const F flip = copysign(splat<F>(1.0f), wo.z);
    const Vec3<F> up = wo * flip;  // rotate by pi rather than mirror: the facets are round
    const MaskOf<F> reflect = choose_lobe(glass_reflection_chance(glass_reflects(params_, wo)), &u);
    const Vec3<F> m = select(reflect, reflecting_.ggx, refracting_.ggx).sample_visible(up, u, v);
    const F c = dot(up, m), eta = relative_eta(params_.p[0], wo), inv = 1.0f / eta;
    F cos_t;
    const F whole = fresnel_dielectric(min(abs(c), splat<F>(1.0f)), eta, &cos_t);
    const Vec3<F> wi = select(reflect, m * (2.0f * c) - up, m * (c * inv - cos_t) - up * inv);
    BsdfSample<F> s;
    s.wi = wi * flip;
    s.valid = mask_and(MaskOf<F>(up.z > 0.0f), MaskOf<F>(select(reflect, wi.z, -wi.z) > 0.0f));
    s.valid = mask_and(s.valid, mask_or(reflect, MaskOf<F>(whole < 1.0f)));
    const BsdfEval<F> e = eval(wo, s.wi, mode);
    s.valid = mask_and(s.valid, MaskOf<F>(e.pdf > 0.0f));
    s.pdf = e.pdf;
    s.pdf_reverse = e.pdf_reverse;
    s.weight = e.f * (abs(s.wi.z) / select(s.valid, e.pdf, splat<F>(1.0f)));
    if (mode == Mode::kImportance) s.roulette_scale = select(reflect, splat<F>(1.0f), eta * eta);
    s.delta = splat_mask<F>(false);
    return s;
  }

 private:
  static AnisotropicGgx<F> select(MaskOf<F> m, const AnisotropicGgx<F>& a, const AnisotropicGgx<F>& b) {
    return {lightmill::select(m, a.alpha_x, b.alpha_x), lightmill::select(m, a.alpha_y, b.alpha_y)};
  }
  template <class A, class B>
  static auto select(MaskOf<F> m, const A& a, const B& b) {
    return lightmill::select(m, a, b);
  }

  BsdfParams<F> params_;
  BlenderFacets<F> reflecting_{}, refracting_{};
};

template <class F>
inline BsdfEval<F> eval_rough_glass(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                    const Vec3<F>& wi, Mode mode) {
  return RoughGlass<F>(params, of_kind).eval(wo, wi, mode);
}
template <class F>
inline BsdfSample<F> sample_rough_glass(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                        F u, F v, Mode mode) {
  return RoughGlass<F>(params, of_kind).sample(wo, u, v, mode);
}

}  // namespace lightmill
