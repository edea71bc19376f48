#pragma once
// Mirrors and smooth glass whose lobe is given, not drawn.
#include "worker/render/bsdf/bsdf_dispatch.h"

namespace lightmill {

/// Probability with which sample_bsdf at a purely specular surface lets what came from `wo` pass; 0 for
/// mirrors.
template <class F>
inline F pass_probability(IntOf<F> kind, const BsdfParams<F>& params, const Vec3<F>& wo) {
  const MaskOf<F> refracts =
      mask_or(MaskOf<F>(kind == kSmoothDielectric), MaskOf<F>(kind == kTintedDielectric));
  const MaskOf<F> sheet = MaskOf<F>(kind == kTintedSheet), thin = MaskOf<F>(kind == kThinDielectric);
  const MaskOf<F> glass = mask_or(refracts, mask_or(sheet, thin));
  const F cosine = abs(wo.z), index = select(glass, params.p[0], splat<F>(1.0f));
  F unused;
  const F face = fresnel_dielectric(cosine, select(refracts, relative_eta(index, wo), index), &unused);
  const F reflects = select(thin, thin_reflectance(cosine, index), face);
  const MaskOf<F> sharp = MaskOf<F>(kind == kSharpGlass);
  if (!any(sharp)) return select(glass, 1.0f - reflects, F{});
  BsdfParams<F> own = params;
  own.p[0] = select(sharp, params.p[0], splat<F>(1.5f));
  return select(sharp, 1.0f - glass_reflection_chance(glass_reflects(own, wo)),
                select(glass, 1.0f - reflects, F{}));
}

/// The BSDF's sample that passes or is reflected, as `passes` says; its weight is that of the lobe alone:
/// what it scatters into that direction. Not valid where there is no such lobe.
template <class F>
inline BsdfSample<F> specular_lobe(IntOf<F> kind, MaskOf<F> active, const BsdfParams<F>& params,
                                   const Vec3<F>& wo, MaskOf<F> passes, Mode mode) {
  const F lobe = select(passes, splat<F>(1 - 0x1p-24f), F{});
  BsdfSample<F> s = sample_bsdf<F>(kind, active, params, wo, lobe, F{}, F{}, mode);
  const MaskOf<F> passed = MaskOf<F>(s.wi.z * wo.z < 0.0f);
  const F p = pass_probability(kind, params, wo);
  s.weight = s.weight * select(passes, p, 1.0f - p);
  s.valid = mask_and(s.valid, mask_and(s.delta, mask_not(MaskOf<F>(passed ^ passes))));
  return s;
}

}  // namespace lightmill
