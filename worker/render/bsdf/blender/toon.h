#pragma once
// Blender's Toon BSDF: as much light from every direction of a cone around the normal (diffuse) or around the
// mirror image of wo (glossy), fading towards its rim. Both sides alike.
//
// What Cycles keeps constant in the cone is f |cos wi|. So f is not reciprocal: that of a path from the light
// is f with its directions exchanged.
//
// Parameters: 0-2 colour, 6 angle of the cone and 7 width of its rim (radians), 8 1 if glossy.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/math/angle.h"
#include "worker/render/math/trig.h"

namespace lightmill {

template <class F>
struct ToonCone {
  F angle, rim, cosine, density;
  MaskOf<F> glossy;

  ToonCone(const BsdfParams<F>& params, MaskOf<F> of_kind) {
    angle = select(of_kind, params.p[6], splat<F>(1.0f));
    rim = select(of_kind, params.p[7], F{});
    glossy = mask_and(of_kind, MaskOf<F>(params.p[8] > 0.0f));
    F sine;
    sincos_2pi(min(angle + rim, splat<F>(0.5f * kPi)) * (0.5f * kInvPi), &sine, &cosine);
    density = 0.5f * kInvPi / (1.0f - cosine);
  }
  Vec3<F> axis(const Vec3<F>& wo) const {
    const F up = copysign(splat<F>(1.0f), wo.z);
    return select(glossy, Vec3<F>{-wo.x, -wo.y, wo.z}, Vec3<F>{F{}, F{}, up});
  }
  F density_of(const Vec3<F>& axis, const Vec3<F>& w) const {
    return select(MaskOf<F>(dot(axis, w) > cosine - 1e-6f), density, F{});
  }
  /// 1 within the cone, 0 beyond the rim.
  F share(const Vec3<F>& axis, const Vec3<F>& w) const {
    const F c = clamp(dot(axis, w), -1.0f, 1.0f);
    const F from = turns(safe_sqrt(1.0f - c * c), c) * (2.0f * kPi);
    return clamp((angle + rim - from) / max(rim, splat<F>(1e-6f)), 0.0f, 1.0f);
  }
};

template <class F>
inline BsdfEval<F> eval_toon(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                             const Vec3<F>& wi, Mode mode) {
  const ToonCone<F> cone(params, of_kind);
  const Vec3<F> at = cone.axis(wo), back = cone.axis(wi);
  const F one = select(same_side(wo, wi), splat<F>(1.0f), F{});
  const bool radiance = mode == Mode::kRadiance;
  const F share = radiance ? cone.share(at, wi) : cone.share(back, wo);
  const F value = cone.density * share / max(abs(radiance ? wi.z : wo.z), splat<F>(1e-6f));
  return {params.rgb(0) * (value * one), cone.density_of(at, wi) * one, cone.density_of(back, wo) * one};
}

template <class F>
inline BsdfSample<F> sample_toon(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo, F u, F v,
                                 Mode mode) {
  const ToonCone<F> cone(params, of_kind);
  F sine, cosine;
  sincos_2pi(u, &sine, &cosine);
  const F z = 1.0f - v * (1.0f - cone.cosine), r = safe_sqrt(1.0f - z * z);
  BsdfSample<F> s;
  s.wi = Frame<F>(cone.axis(wo)).to_world({r * cosine, r * sine, z});
  const BsdfEval<F> e = eval_toon(params, of_kind, wo, s.wi, mode);
  s.valid = mask_and(MaskOf<F>(wo.z != 0.0f), MaskOf<F>(e.pdf > 0.0f));
  s.weight = e.f * (abs(s.wi.z) / select(s.valid, e.pdf, splat<F>(1.0f)));
  s.pdf = e.pdf;
  s.pdf_reverse = e.pdf_reverse;
  s.delta = splat_mask<F>(false);
  return s;
}

}  // namespace lightmill
