#pragma once
// A thin sheet of dielectric between two parallel smooth faces: a window pane or a bubble. Light passes
// straight through; nothing is focused, so radiance is not scaled and both modes of transport agree.
//
// With R the reflectance of one face and T = 1 - R, the faces exchange light for ever (pbrt-v4 §9.5.3):
//   R' = R + T R T + T R^3 T + ... = R + T^2 R / (1 - R^2) = 2 R / (1 + R),   T' = 1 - R'
// The last form of R' has no cancellation and no pole at R = 1.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"

namespace lightmill {

/// R' at the cosine |cos| to the normal; `eta` is the index of the sheet over that of its surroundings.
template <class F>
inline F thin_reflectance(F cosine, F eta) {
  F unused;
  const F face = fresnel_dielectric(cosine, eta, &unused);
  return 2.0f * face / (1.0f + face);
}

/// `lobe` chooses between reflection and transmission with R'. params.p[0] is the index; if params.p[1] is
/// not 0, what would pass has done so without a vertex (pane.h), and all that comes here is reflected.
template <class F>
inline BsdfSample<F> sample_thin_dielectric(const BsdfParams<F>& params, const Vec3<F>& wo, F lobe) {
  const MaskOf<F> reflect =
      mask_or(MaskOf<F>(lobe < thin_reflectance(F(abs(wo.z)), params.p[0])), MaskOf<F>(params.p[1] > 0.0f));
  BsdfSample<F> s;
  s.wi = {-wo.x, -wo.y, select(reflect, wo.z, -wo.z)};
  s.weight = {splat<F>(1.0f), splat<F>(1.0f), splat<F>(1.0f)};
  s.pdf = s.pdf_reverse = splat<F>(1.0f);
  s.valid = MaskOf<F>(wo.z != 0.0f);
  s.delta = splat_mask<F>(true);
  return s;
}

}  // namespace lightmill
