#pragma once
// Evaluation and sampling with a kind per lane: each kind that is present is computed once for all lanes and
// selected, so a group of one kind (what the bouncer's counting sort makes) costs one kernel. Diffuse
// surfaces, the commonest, are computed in place, all others in functions of their own: inlined beside them,
// they would cost diffuse surfaces their registers.
#include "worker/render/bsdf/anisotropic.h"
#include "worker/render/bsdf/blender/glass.h"
#include "worker/render/bsdf/blender/glossy.h"
#include "worker/render/bsdf/blender/oren_nayar.h"
#include "worker/render/bsdf/blender/principled.h"
#include "worker/render/bsdf/blender/toon.h"
#include "worker/render/bsdf/blender/velvet.h"
#include "worker/render/bsdf/brushed.h"
#include "worker/render/bsdf/conductor.h"
#include "worker/render/bsdf/dielectric.h"
#include "worker/render/bsdf/diffuse.h"
#include "worker/render/bsdf/diffuse_transmission.h"
#include "worker/render/bsdf/hair.h"
#include "worker/render/bsdf/henyey_greenstein.h"
#include "worker/render/bsdf/layered/coated_conductor.h"
#include "worker/render/bsdf/layered/coated_diffuse.h"
#include "worker/render/bsdf/layered/tinted.h"
#include "worker/render/bsdf/measured.h"
#include "worker/render/bsdf/metallic_roughness.h"
#include "worker/render/bsdf/subsurface.h"
#include "worker/render/bsdf/thin_dielectric.h"
#include "worker/render/bsdf/translucent.h"

namespace lightmill {

/// Calls fn(kind, mask) for every kind that occurs among the active lanes.
template <class F, class Fn>
inline void for_each_kind(IntOf<F> kind, MaskOf<F> active, Fn&& fn) {
  for (unsigned left = mask_bits(active); left;) {
    const int32_t k = lane(kind, std::countr_zero(left));
    const MaskOf<F> mask = mask_and(active, MaskOf<F>(kind == k));
    fn(k, mask);
    left &= ~mask_bits(mask);
  }
}

template <class F>
inline void merge(MaskOf<F> m, const BsdfEval<F>& from, BsdfEval<F>* to) {
  to->f = select(m, from.f, to->f);
  to->pdf = select(m, from.pdf, to->pdf);
  to->pdf_reverse = select(m, from.pdf_reverse, to->pdf_reverse);
}

/// The kinds but kDiffuse.
template <class F>
[[gnu::noinline]] BsdfEval<F> eval_other_bsdf(IntOf<F> kind, MaskOf<F> active, const BsdfParams<F>& params,
                                              const Vec3<F>& wo, const Vec3<F>& wi, Mode mode) {
  BsdfEval<F> result{};
  for_each_kind<F>(kind, active, [&](int32_t k, MaskOf<F> m) {
    switch (k) {
      case kRoughConductor:
        return merge(m, eval_rough_conductor(Ggx<F>{params.p[6]}, params, m, wo, wi), &result);
      case kRoughDielectric:
        return merge(m, eval_rough_dielectric(Ggx<F>{params.p[6]}, params, wo, wi, mode), &result);
      case kSmoothCoated:
        return merge(m, eval_coated<F, false, false>(params, m, wo, wi), &result);
      case kRoughCoated:
        return merge(m, eval_coated<F, true, false>(params, m, wo, wi), &result);
      case kAnisotropicConductor:
        return merge(m, eval_anisotropic_conductor(params, m, wo, wi), &result);
      case kAnisotropicDielectric:
        return merge(m, eval_anisotropic_dielectric(params, wo, wi, mode), &result);
      case kDiffuseTransmission:
        return merge(m, eval_diffuse_transmission(params, wo, wi), &result);
      case kCoatedConductor:
        return merge(m, eval_coated_conductor<F, false, false>(params, m, wo, wi), &result);
      case kRoughCoatedConductor:
        return merge(m, eval_coated_conductor<F, true, false>(params, m, wo, wi), &result);
      case kScatteringCoated:
        return merge(m, eval_coated<F, false, true>(params, m, wo, wi), &result);
      case kRoughScatteringCoated:
        return merge(m, eval_coated<F, true, true>(params, m, wo, wi), &result);
      case kScatteringCoatedConductor:
        return merge(m, eval_coated_conductor<F, false, true>(params, m, wo, wi), &result);
      case kRoughScatteringCoatedConductor:
        return merge(m, eval_coated_conductor<F, true, true>(params, m, wo, wi), &result);
      case kAnisotropicCoated:
        return merge(m, eval_anisotropic_coated(params, m, wo, wi), &result);
      case kAnisotropicCoatedConductor:
        return merge(m, eval_anisotropic_coated_conductor<F, false>(params, m, wo, wi), &result);
      case kAnisotropicRoughCoatedConductor:
        return merge(m, eval_anisotropic_coated_conductor<F, true>(params, m, wo, wi), &result);
      case kMetallicRoughness:
        return merge(m, eval_metallic_roughness<F, false>(params, m, wo, wi), &result);
      case kCoatedMetallicRoughness:
        return merge(m, eval_metallic_roughness<F, true>(params, m, wo, wi), &result);
      case kSheenMetallicRoughness:
        return merge(m, eval_sheen(params, m, wo, wi), &result);
      case kIridescent:
        return merge(m, eval_iridescent(params, m, wo, wi), &result);
      case kAnisotropicMetallicRoughness:
        return merge(m, eval_brushed(params, m, wo, wi), &result);
      case kTranslucent:
        return merge(m, eval_translucent(params, m, wo, wi), &result);
      case kPrincipled:
        return merge(m, eval_principled<F, false>(params, m, wo, wi), &result);
      case kAnisotropicPrincipled:
        return merge(m, eval_principled<F, true>(params, m, wo, wi), &result);
      case kOrenNayar:
        return merge(m, eval_oren_nayar(params, wo, wi), &result);
      case kGlossy:
        return merge(m, eval_glossy<F, false>(params, m, wo, wi), &result);
      case kAnisotropicGlossy:
        return merge(m, eval_glossy<F, true>(params, m, wo, wi), &result);
      case kRoughGlass:
        return merge(m, eval_rough_glass(params, m, wo, wi, mode), &result);
      case kVelvet:
        return merge(m, eval_velvet(params, wo, wi), &result);
      case kToon:
        return merge(m, eval_toon(params, m, wo, wi, mode), &result);
      case kRoughTintedDielectric:
        return merge(m, eval_rough_tinted_dielectric(params, wo, wi, mode), &result);
      case kRoughTintedSheet:
        return merge(m, eval_rough_tinted_sheet(params, m, wo, wi), &result);
      case kHair:
        return merge(m, eval_hair(params, wo, wi, mode), &result);
      case kMeasured:
        return merge(m, eval_measured(params, m, wo, wi, mode), &result);
      case kPhaseFunction:
        return merge(m, eval_henyey_greenstein(params, wi), &result);
      case kRoughSubsurface:
        return merge(m, eval_subsurface_reflection(params, m, wo, wi), &result);
      case kSubsurfaceExit:
        return merge(m, eval_subsurface_exit<F, false>(params, m, wo, wi), &result);
      case kRoughSubsurfaceExit:
        return merge(m, eval_subsurface_exit<F, true>(params, m, wo, wi), &result);
      default:
        return;
    }
  });
  return result;
}

/// Zero for pure delta kinds and for lanes that are not active. Without `kAnySurface` (kernel_set.h) every
/// lane is taken to be active and diffuse.
template <class F, bool kAnySurface = true>
inline BsdfEval<F> eval_bsdf(IntOf<F> kind, MaskOf<F> active, const BsdfParams<F>& params, const Vec3<F>& wo,
                             const Vec3<F>& wi, Mode mode) {
  if constexpr (!kAnySurface) return eval_diffuse(params, wo, wi);
  const MaskOf<F> diffuse = mask_and(active, MaskOf<F>(kind == kDiffuse)),
                  other = mask_and(active, mask_not(diffuse));
  BsdfEval<F> result{};
  if (any(other)) result = eval_other_bsdf<F>(kind, other, params, wo, wi, mode);
  if (any(diffuse)) merge(diffuse, eval_diffuse(params, wo, wi), &result);
  return result;
}

template <class F>
inline void merge(MaskOf<F> m, const BsdfSample<F>& from, BsdfSample<F>* to) {
  to->wi = select(m, from.wi, to->wi);
  to->weight = select(m, from.weight, to->weight);
  to->pdf = select(m, from.pdf, to->pdf);
  to->pdf_reverse = select(m, from.pdf_reverse, to->pdf_reverse);
  to->roulette_scale = select(m, from.roulette_scale, to->roulette_scale);
  to->valid = mask_or(to->valid, mask_and(m, from.valid));
  to->delta = mask_or(to->delta, mask_and(m, from.delta));
}

/// The kinds but kDiffuse.
template <class F>
[[gnu::noinline]] BsdfSample<F> sample_other_bsdf(IntOf<F> kind, MaskOf<F> active,
                                                  const BsdfParams<F>& params, const Vec3<F>& wo, F lobe, F u,
                                                  F v, Mode mode) {
  BsdfSample<F> result{};
  const auto take = [&](MaskOf<F> m, const BsdfSample<F>& s) { merge(m, s, &result); };
  for_each_kind<F>(kind, active, [&](int32_t k, MaskOf<F> m) {
    switch (k) {
      case kRoughConductor:
        return take(m, sample_rough_conductor(Ggx<F>{params.p[6]}, params, m, wo, u, v));
      case kSmoothConductor:
        return take(m, sample_smooth_conductor(params, wo));
      case kSmoothDielectric:
        return take(m, sample_smooth_dielectric(params, wo, lobe, mode));
      case kRoughDielectric:
        return take(m, sample_rough_dielectric(Ggx<F>{params.p[6]}, params, wo, lobe, u, v, mode));
      case kSmoothCoated:
        return take(m, sample_coated<F, false, false>(params, m, wo, u, v));
      case kRoughCoated:
        return take(m, sample_coated<F, true, false>(params, m, wo, u, v));
      case kThinDielectric:
        return take(m, sample_thin_dielectric(params, wo, lobe));
      case kAnisotropicConductor:
        return take(m, sample_anisotropic_conductor(params, m, wo, u, v));
      case kAnisotropicDielectric:
        return take(m, sample_anisotropic_dielectric(params, wo, lobe, u, v, mode));
      case kDiffuseTransmission:
        return take(m, sample_diffuse_transmission(params, wo, u, v));
      case kSmoothCoatedConductor:
        return take(m, sample_smooth_coated_conductor(params, wo));
      case kCoatedConductor:
        return take(m, sample_coated_conductor<F, false, false>(params, m, wo, u, v));
      case kRoughCoatedConductor:
        return take(m, sample_coated_conductor<F, true, false>(params, m, wo, u, v));
      case kScatteringCoated:
        return take(m, sample_coated<F, false, true>(params, m, wo, u, v));
      case kRoughScatteringCoated:
        return take(m, sample_coated<F, true, true>(params, m, wo, u, v));
      case kScatteringCoatedConductor:
        return take(m, sample_coated_conductor<F, false, true>(params, m, wo, u, v));
      case kRoughScatteringCoatedConductor:
        return take(m, sample_coated_conductor<F, true, true>(params, m, wo, u, v));
      case kAnisotropicCoated:
        return take(m, sample_anisotropic_coated(params, m, wo, u, v));
      case kAnisotropicCoatedConductor:
        return take(m, sample_anisotropic_coated_conductor<F, false>(params, m, wo, u, v));
      case kAnisotropicRoughCoatedConductor:
        return take(m, sample_anisotropic_coated_conductor<F, true>(params, m, wo, u, v));
      case kMetallicRoughness:
        return take(m, sample_metallic_roughness<F, false>(params, m, wo, u, v));
      case kCoatedMetallicRoughness:
        return take(m, sample_metallic_roughness<F, true>(params, m, wo, u, v));
      case kSheenMetallicRoughness:
        return take(m, sample_sheen(params, m, wo, u, v));
      case kIridescent:
        return take(m, sample_iridescent(params, m, wo, u, v));
      case kAnisotropicMetallicRoughness:
        return take(m, sample_brushed(params, m, wo, u, v));
      case kTranslucent:
        return take(m, sample_translucent(params, m, wo, u, v));
      case kPrincipled:
        return take(m, sample_principled<F, false>(params, m, wo, u, v));
      case kAnisotropicPrincipled:
        return take(m, sample_principled<F, true>(params, m, wo, u, v));
      case kOrenNayar:
        return take(m, sample_oren_nayar(params, wo, u, v));
      case kGlossy:
        return take(m, sample_glossy<F, false>(params, m, wo, u, v));
      case kAnisotropicGlossy:
        return take(m, sample_glossy<F, true>(params, m, wo, u, v));
      case kSharpGlass:
        return take(m, sample_sharp_glass(params, wo, lobe, mode));
      case kRoughGlass:
        return take(m, sample_rough_glass(params, m, wo, u, v, mode));
      case kVelvet:
        return take(m, sample_velvet(params, wo, u, v));
      case kToon:
        return take(m, sample_toon(params, m, wo, u, v, mode));
      case kTintedDielectric:
        return take(m, sample_tinted_dielectric(params, wo, lobe, mode));
      case kRoughTintedDielectric:
        return take(m, sample_rough_tinted_dielectric(params, wo, lobe, u, v, mode));
      case kTintedSheet:
        return take(m, sample_tinted_sheet(params, wo, lobe));
      case kRoughTintedSheet:
        return take(m, sample_rough_tinted_sheet(params, m, wo, lobe, u, v));
      case kHair:
        return take(m, sample_hair(params, wo, lobe, u, v, mode));
      case kMeasured:
        return take(m, sample_measured(params, m, wo, u, v, mode));
      case kPhaseFunction:
        return take(m, sample_henyey_greenstein(params, u, v));
      case kSubsurface:
        return take(m, sample_subsurface<F, false>(params, m, wo, lobe, u, v));
      case kRoughSubsurface:
        return take(m, sample_subsurface<F, true>(params, m, wo, lobe, u, v));
      case kSubsurfaceExit:
        return take(m, sample_subsurface_exit<F, false>(params, m, wo, u, v));
      case kRoughSubsurfaceExit:
        return take(m, sample_subsurface_exit<F, true>(params, m, wo, u, v));
      default:
        return;
    }
  });
  return result;
}

/// `lobe`, `u`, `v` are independent uniforms in [0, 1); `kAnySurface` as for eval_bsdf.
template <class F, bool kAnySurface = true>
inline BsdfSample<F> sample_bsdf(IntOf<F> kind, MaskOf<F> active, const BsdfParams<F>& params,
                                 const Vec3<F>& wo, F lobe, F u, F v, Mode mode) {
  if constexpr (!kAnySurface) return sample_diffuse(params, wo, u, v);
  const MaskOf<F> diffuse = mask_and(active, MaskOf<F>(kind == kDiffuse)),
                  other = mask_and(active, mask_not(diffuse));
  BsdfSample<F> result{};
  if (any(other)) result = sample_other_bsdf<F>(kind, other, params, wo, lobe, u, v, mode);
  if (any(diffuse)) merge(diffuse, sample_diffuse(params, wo, u, v), &result);
  return result;
}

}  // namespace lightmill
