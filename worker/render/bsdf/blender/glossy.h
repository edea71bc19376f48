#pragma once
// Blender's Glossy BSDF: a coloured reflection without a Fresnel term, both sides alike, by the distributions
// of facets.h. Reciprocal.
//
// Parameters: 0-2 colour, 6 alpha along the tangent, 7 distribution, 8 alpha across, 9 (anisotropic) rotation
// of the tangent as anisotropic.h says.
#include "worker/render/bsdf/blender/facets.h"
#include "worker/render/bsdf/bsdf.h"

namespace lightmill {

template <class F>
inline BlenderFacets<F> glossy_facets(const BsdfParams<F>& params, MaskOf<F> of_kind) {
  const auto alpha = [&](int slot) {
    return max(select(of_kind, params.p[slot], splat<F>(1.0f)), splat<F>(kSmoothAlpha));
  };
  return {{alpha(6), alpha(8)}, select(of_kind, params.p[7], F{})};
}

template <class F>
inline BsdfEval<F> eval_glossy(const BlenderFacets<F>& facets, const BsdfParams<F>& params, const Vec3<F>& wo,
                               const Vec3<F>& wi) {
  const Vec3<F> h = wo + wi;
  const F h2 = dot(h, h);
  const MaskOf<F> valid = mask_and(MaskOf<F>(h2 > 1e-12f), same_side(wo, wi));
  const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
  const F one = select(valid, splat<F>(1.0f), F{});
  const F co = max(abs(wo.z), splat<F>(1e-6f)), ci = max(abs(wi.z), splat<F>(1e-6f)), d = facets.ggx.d(m);
  Vec3<F> colour = params.rgb(0);
  const MaskOf<F> multiple = facets.is(kMultiGgxFacets);
  if (any(multiple)) {
    const F alpha = sqrt(facets.ggx.alpha_x * facets.ggx.alpha_y);
    const Vec3<F> more = multiple_bounces(params.tables, colour, alpha, co, ci);
    colour = select(multiple, colour * more, colour);
  }
  return {colour * (facets.density(m, wo, wi) * 0.25f / (co * ci) * one),
          d * facets.ggx.reflection_density(wo) * one, d * facets.ggx.reflection_density(wi) * one};
}

template <class F>
inline BsdfSample<F> sample_glossy(const BlenderFacets<F>& facets, const BsdfParams<F>& params,
                                   const Vec3<F>& wo, F u, F v) {
  const Vec3<F> up{wo.x, wo.y, abs(wo.z)};
  const Vec3<F> m = facets.ggx.sample_reflecting(up, u, v);
  BsdfSample<F> s;
  s.wi = m * (2.0f * dot(up, m)) - up;
  s.valid = mask_and(MaskOf<F>(s.wi.z > 0.0f), MaskOf<F>(up.z > 0.0f));
  s.wi.z = copysign(s.wi.z, wo.z);
  const BsdfEval<F> e = eval_glossy(facets, params, wo, s.wi);
  s.valid = mask_and(s.valid, MaskOf<F>(e.pdf > 0.0f));
  s.weight = e.f * (abs(s.wi.z) / select(s.valid, e.pdf, splat<F>(1.0f)));
  s.pdf = e.pdf;
  s.pdf_reverse = e.pdf_reverse;
  s.delta = splat_mask<F>(false);
  return s;
}

template <class F, bool kAnisotropic>
inline BsdfEval<F> eval_glossy(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                               const Vec3<F>& wi) {
  const BlenderFacets<F> facets = glossy_facets(params, of_kind);
  if constexpr (!kAnisotropic) return eval_glossy(facets, params, wo, wi);
  const LobeAxes<F> axes(select(of_kind, params.p[9], F{}));
  return eval_glossy(facets, params, axes.to_lobe(wo), axes.to_lobe(wi));
}

template <class F, bool kAnisotropic>
inline BsdfSample<F> sample_glossy(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo, F u,
                                   F v) {
  const BlenderFacets<F> facets = glossy_facets(params, of_kind);
  if constexpr (!kAnisotropic) return sample_glossy(facets, params, wo, u, v);
  const LobeAxes<F> axes(select(of_kind, params.p[9], F{}));
  BsdfSample<F> s = sample_glossy(facets, params, axes.to_lobe(wo), u, v);
  s.wi = axes.from_lobe(s.wi);
  return s;
}

}  // namespace lightmill
