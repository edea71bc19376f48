#pragma once
// Lobes with a roughness for each tangent direction: those of conductor.h, dielectric.h and of the coated
// kinds in axes that follow dp/du. Parameters as theirs, 9 rotation of the tangent within Frame(ns), in
// turns; of metals and dielectrics 6 alpha along the tangent, 8 alpha across it; coated kinds have a block of
// coat_scattering.h with their anisotropies, whether or not the coat scatters, and energies as if round.
#include "worker/render/bsdf/conductor.h"
#include "worker/render/bsdf/dielectric.h"
#include "worker/render/bsdf/layered/coated_conductor.h"
#include "worker/render/bsdf/layered/coated_diffuse.h"

namespace lightmill {

template <class F>
inline AnisotropicGgx<F> anisotropic_ggx(const BsdfParams<F>& params) {
  return {max(params.p[6], splat<F>(kSmoothAlpha)), max(params.p[8], splat<F>(kSmoothAlpha))};
}

template <class F>
inline BsdfEval<F> eval_anisotropic_conductor(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                              const Vec3<F>& wo, const Vec3<F>& wi) {
  const LobeAxes<F> axes(params.p[9]);
  return eval_rough_conductor(anisotropic_ggx(params), params, of_kind, axes.to_lobe(wo), axes.to_lobe(wi));
}

template <class F>
inline BsdfSample<F> sample_anisotropic_conductor(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                                  const Vec3<F>& wo, F u, F v) {
  const LobeAxes<F> axes(params.p[9]);
  BsdfSample<F> s = sample_rough_conductor(anisotropic_ggx(params), params, of_kind, axes.to_lobe(wo), u, v);
  s.wi = axes.from_lobe(s.wi);
  return s;
}

template <class F>
inline BsdfEval<F> eval_anisotropic_dielectric(const BsdfParams<F>& params, const Vec3<F>& wo,
                                               const Vec3<F>& wi, Mode mode) {
  const LobeAxes<F> axes(params.p[9]);
  return eval_rough_dielectric(anisotropic_ggx(params), params, axes.to_lobe(wo), axes.to_lobe(wi), mode);
}

template <class F>
inline BsdfSample<F> sample_anisotropic_dielectric(const BsdfParams<F>& params, const Vec3<F>& wo, F lobe,
                                                   F u, F v, Mode mode) {
  const LobeAxes<F> axes(params.p[9]);
  BsdfSample<F> s =
      sample_rough_dielectric(anisotropic_ggx(params), params, axes.to_lobe(wo), lobe, u, v, mode);
  s.wi = axes.from_lobe(s.wi);
  return s;
}

template <class F>
inline BsdfEval<F> eval_anisotropic_coated(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                           const Vec3<F>& wi) {
  const LobeAxes<F> axes(params.p[9]);
  return eval_coated<F, true, true, true>(params, of_kind, axes.to_lobe(wo), axes.to_lobe(wi));
}

template <class F>
inline BsdfSample<F> sample_anisotropic_coated(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                               const Vec3<F>& wo, F u, F v) {
  const LobeAxes<F> axes(params.p[9]);
  BsdfSample<F> s = sample_coated<F, true, true, true>(params, of_kind, axes.to_lobe(wo), u, v);
  s.wi = axes.from_lobe(s.wi);
  return s;
}

template <class F, bool kRough>
inline BsdfEval<F> eval_anisotropic_coated_conductor(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                                     const Vec3<F>& wo, const Vec3<F>& wi) {
  const LobeAxes<F> axes(params.p[9]);
  return eval_coated_conductor<F, kRough, true, true>(params, of_kind, axes.to_lobe(wo), axes.to_lobe(wi));
}

template <class F, bool kRough>
inline BsdfSample<F> sample_anisotropic_coated_conductor(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                                         const Vec3<F>& wo, F u, F v) {
  const LobeAxes<F> axes(params.p[9]);
  BsdfSample<F> s = sample_coated_conductor<F, kRough, true, true>(params, of_kind, axes.to_lobe(wo), u, v);
  s.wi = axes.from_lobe(s.wi);
  return s;
}

}  // namespace lightmill
