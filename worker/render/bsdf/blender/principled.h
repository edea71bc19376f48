#pragma once
// Blender's Principled BSDF as Cycles 3.4 has it, but for what goes through the surface: Burley's diffuse
// lobe and sheen, a specular lobe and a clear coat, added up. Both sides alike. Reciprocal; it may reflect
// more than it receives, as no lobe is dimmed by another.
//
//   diffuse   rho / pi ((1 - F_o / 2)(1 - F_i / 2) + R (F_o + F_i + F_o F_i (R - 1))), F = (1 - cos)^5,
//             R = roughness (1 + cos(wo, wi)) (Burley, "Extending the Disney BRDF to a BSDF with integrated
//             subsurface scattering", 2015)
//   sheen     colour (1 - <wo, m>)^5
//   specular  GGX with separate masking (facets.h) times c (1 - f) + weight f, where f is a dielectric's
//             Fresnel term over <wo, m> stretched from 0 at normal incidence to 1 at grazing; its index has
//             the reflectance 0.08 specular
//   coat      weight / 4 times GTR1 facets (Burley, "Physically based shading at Disney", 2012), masked like
//             GGX of alpha 1/4, and a dielectric's Fresnel term, 0.04 to 1
//
// Of the distribution with several bounces (multiple_bounces of facets.h), which only round lobes have here,
// masking is not separate.
//
// Parameters: 0-2 rho, 3-5 c, 6 roughness and anisotropy (packed_pair; of round lobes 1 in its place stands
// for several bounces), 7 specular, sheen tint and weight of
// the specular lobe (packed_triple), 8 sheen, coat and its roughness (packed_triple), 9 (anisotropic)
// rotation of the tangent as anisotropic.h says.
#include "worker/render/bsdf/blender/facets.h"
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/packed_params.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

/// A dielectric's Fresnel term of an index from 1 up, stretched to begin at 0.
template <class F>
struct StretchedFresnel {
  F ior, f0;
  explicit StretchedFresnel(F index) : ior(index) {
    const F r = (index - 1.0f) / (index + 1.0f);
    f0 = r * r;
  }
  F operator()(F cosine) const {
    F unused;
    return clamp((fresnel_dielectric(cosine, ior, &unused) - f0) / (1.0f - f0), 0.0f, 1.0f);
  }
};

inline constexpr float kPrincipledCoatIor = 1.5f, kPrincipledCoatAlpha = 0.25f;

template <class F, bool kAnisotropic>
class Principled {
 public:
  Principled(const BsdfParams<F>& params, MaskOf<F> of_kind) : diffuse_(params.rgb(0)), f0_(params.rgb(3)) {
    const UnpackedPair<F> shape(params.p[6], of_kind);
    tables_ = params.tables;
    multiple_ = mask_and(of_kind, MaskOf<F>(shape.second > 0.5f));
    const UnpackedTriple<F> levels(params.p[7], of_kind), layers(params.p[8], of_kind);
    roughness_ = shape.first;
    const F alpha = roughness_ * roughness_;
    facets_.alpha_x = facets_.alpha_y = max(alpha, splat<F>(kSmoothAlpha));
    if constexpr (kAnisotropic) {
      const F aspect = sqrt(1.0f - 0.9f * shape.second);
      facets_.alpha_x = max(alpha / aspect, splat<F>(kSmoothAlpha));
      facets_.alpha_y = max(alpha * aspect, splat<F>(kSmoothAlpha));
    }
    specular_ = StretchedFresnel<F>(2.0f / (1.0f - sqrt(0.08f * levels.first)) - 1.0f);
    specular_weight_ = levels.third;
    const F luminance = 0.2126f * diffuse_.x + 0.7152f * diffuse_.y + 0.0722f * diffuse_.z;
    const MaskOf<F> coloured = MaskOf<F>(luminance > 0.0f);
    const F inv = levels.second / select(coloured, luminance, splat<F>(1.0f));
    const F white = select(coloured, 1.0f - levels.second, splat<F>(1.0f));
    sheen_ = (diffuse_ * inv + Vec3<F>{white, white, white}) * layers.first;
    coat_ = 0.25f * layers.second;
    coat_alpha_ = max(layers.third * layers.third, splat<F>(kSmoothAlpha));
  }

  /// What the lobes do along one direction.
  struct Side {
    F cosine, fresnel, g1, coat_g1;
    F diffuse, specular;  // probabilities; the coat has the rest
  };
  Side side(const Vec3<F>& w) const {
    Side s;
    s.cosine = max(abs(w.z), splat<F>(1e-6f));
    s.fresnel = schlick_weight(s.cosine);
    s.g1 = facets_.g1(w);
    const MaskOf<F> coated = MaskOf<F>(coat_ > 0.0f);
    s.coat_g1 = splat<F>(1.0f);
    if (any(coated)) s.coat_g1 = Ggx<F>{splat<F>(kPrincipledCoatAlpha)}.g1(w);
    // Albedos, nearly. A fibre's is about that at grazing light times the part of the hemisphere there.
    const F grazing = 1.0f - s.cosine;
    const F diffuse = max_component(diffuse_) + max_component(sheen_) * (0.03f + 0.4f * grazing * grazing);
    const F f = specular_(s.cosine);
    const F specular = max_component(f0_) * (1.0f - f) + specular_weight_ * f;
    const F coat = coat_ * (0.04f + 0.96f * StretchedFresnel<F>(splat<F>(kPrincipledCoatIor))(s.cosine));
    const F sum = diffuse + specular + coat;
    const MaskOf<F> some = MaskOf<F>(sum > 0.0f);
    const F inv = 1.0f / select(some, sum, splat<F>(1.0f));
    s.diffuse = select(some, diffuse * inv, splat<F>(1.0f));
    s.specular = specular * inv;
    return s;
  }

  BsdfEval<F> eval(const Side& o, const Side& i, const Vec3<F>& wo, const Vec3<F>& wi) const {
    const Vec3<F> h = wo + wi;
    const F h2 = dot(h, h);
    const MaskOf<F> valid = mask_and(MaskOf<F>(h2 > 1e-12f), same_side(wo, wi));
    const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
    const F facet = clamp(abs(dot(wo, m)), 0.0f, 1.0f), quarter = 0.25f / (o.cosine * i.cosine);
    const F d = facets_.d(m), lobe = d * o.g1 * i.g1 * quarter;
    const F f = specular_(facet), kept = 1.0f - f, rise = specular_weight_ * f;
    BsdfEval<F> e;
    Vec3<F> specular = (f0_ * kept + Vec3<F>{rise, rise, rise}) * lobe;
    if constexpr (!kAnisotropic) {
      if (any(multiple_)) {
        const F whole = d * Ggx<F>{facets_.alpha_x}.g(wo, wi) * quarter;
        const Vec3<F> more = multiple_bounces(tables_, f0_, facets_.alpha_x, o.cosine, i.cosine);
        specular = select(multiple_, (f0_ * kept + Vec3<F>{rise, rise, rise}) * whole * more, specular);
      }
    }
    e.f = diffuse_lobes(o, i, wo, wi, facet) + specular;
    e.pdf = o.diffuse * i.cosine * kInvPi + o.specular * d * facets_.reflection_density(wo);
    e.pdf_reverse = i.diffuse * o.cosine * kInvPi + i.specular * d * facets_.reflection_density(wi);
    const MaskOf<F> coated = mask_and(valid, MaskOf<F>(coat_ > 0.0f));
    if (any(coated)) {
      const F dc = coat_d(m);
      const F fc = 0.04f + 0.96f * StretchedFresnel<F>(splat<F>(kPrincipledCoatIor))(facet);
      const F reflected = select(coated, coat_ * fc * dc * o.coat_g1 * i.coat_g1 * quarter, F{});
      e.f = e.f + Vec3<F>{reflected, reflected, reflected};
      const F density = select(coated, dc * abs(m.z) * 0.25f / max(facet, splat<F>(1e-6f)), F{});
      e.pdf = e.pdf + max(1.0f - o.diffuse - o.specular, F{}) * density;
      e.pdf_reverse = e.pdf_reverse + max(1.0f - i.diffuse - i.specular, F{}) * density;
    }
    const F one = select(valid, splat<F>(1.0f), F{});
    return {e.f * one, e.pdf * one, e.pdf_reverse * one};
  }

  /// The part of eval's value that the diffuse lobe and sheen have.
  Vec3<F> diffuse(const Side& o, const Side& i, const Vec3<F>& wo, const Vec3<F>& wi) const {
    const Vec3<F> h = wo + wi;
    const F h2 = dot(h, h);
    const MaskOf<F> valid = mask_and(MaskOf<F>(h2 > 1e-12f), same_side(wo, wi));
    const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
    const F facet = clamp(abs(dot(wo, m)), 0.0f, 1.0f);
    return diffuse_lobes(o, i, wo, wi, facet) * select(valid, splat<F>(1.0f), F{});
  }

  BsdfSample<F> sample(const Vec3<F>& wo, F u, F v) const {
    const Side o = side(wo);
    const Vec3<F> up{wo.x, wo.y, abs(wo.z)};
    const MaskOf<F> diffuse = choose_lobe(o.diffuse, &u);
    const F rest = max(1.0f - o.diffuse, splat<F>(1e-12f));
    const MaskOf<F> bare = mask_or(diffuse, mask_not(MaskOf<F>(coat_ > 0.0f)));
    const MaskOf<F> not_of_coat = choose_lobe(select(bare, splat<F>(1.0f), o.specular / rest), &u);
    Vec3<F> m = facets_.sample_reflecting(up, u, v);
    if (any(mask_not(not_of_coat))) m = select(not_of_coat, m, sample_coat(u, v));
    Vec3<F> wi = select(diffuse, square_to_cosine_hemisphere(u, v), m * (2.0f * dot(up, m)) - up);
    BsdfSample<F> s;
    s.valid = mask_and(MaskOf<F>(wi.z > 0.0f), MaskOf<F>(up.z > 0.0f));
    wi.z = copysign(wi.z, wo.z);
    s.wi = wi;
    const BsdfEval<F> e = eval(o, side(wi), wo, wi);
    s.valid = mask_and(s.valid, MaskOf<F>(e.pdf > 0.0f));
    s.weight = e.f * (abs(wi.z) / select(s.valid, e.pdf, splat<F>(1.0f)));
    s.pdf = e.pdf;
    s.pdf_reverse = e.pdf_reverse;
    s.delta = splat_mask<F>(false);
    return s;
  }

 private:
  /// `facet`: cosine of either direction to the facet between them.
  Vec3<F> diffuse_lobes(const Side& o, const Side& i, const Vec3<F>& wo, const Vec3<F>& wi, F facet) const {
    const F retro = roughness_ * (1.0f + dot(wo, wi));
    const F burley = (1.0f - 0.5f * o.fresnel) * (1.0f - 0.5f * i.fresnel) +
                     retro * (o.fresnel + i.fresnel + o.fresnel * i.fresnel * (retro - 1.0f));
    return diffuse_ * (burley * kInvPi) + sheen_ * schlick_weight(facet);
  }
  /// GTR1, per unit solid angle: (a^2 - 1) / (pi ln a^2 (1 + (a^2 - 1) z^2)); its cosine integrates to 1.
  F coat_d(const Vec3<F>& m) const {
    const F a2 = min(coat_alpha_ * coat_alpha_, splat<F>(0.9999f));
    const F s2 = m.x * m.x + m.y * m.y;
    return (1.0f - a2) * kInvPi / (-log_positive(a2) * (s2 + a2 * m.z * m.z));
  }
  Vec3<F> sample_coat(F u, F v) const {
    const F a2 = min(coat_alpha_ * coat_alpha_, splat<F>(0.9999f));
    // 1 - z^2 = (a^2^(1 - v) - a^2) / (1 - a^2)
    const F s2 = clamp((exp_negative((1.0f - v) * log_positive(a2)) - a2) / (1.0f - a2), 0.0f, 1.0f);
    F s, c;
    sincos_2pi(u, &s, &c);
    const F sine = sqrt(s2);
    return {sine * c, sine * s, sqrt(1.0f - s2)};
  }

  const float* tables_ = nullptr;
  MaskOf<F> multiple_{};
  Vec3<F> diffuse_, f0_, sheen_{};
  F roughness_{};
  AnisotropicGgx<F> facets_{};
  StretchedFresnel<F> specular_{splat<F>(1.0f)};
  F specular_weight_{}, coat_{}, coat_alpha_{};
};

template <class F, bool kAnisotropic>
inline BsdfEval<F> eval_principled(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                   const Vec3<F>& wi) {
  const Principled<F, kAnisotropic> m(params, of_kind);
  if constexpr (!kAnisotropic) return m.eval(m.side(wo), m.side(wi), wo, wi);
  const LobeAxes<F> axes(select(of_kind, params.p[9], F{}));
  const Vec3<F> o = axes.to_lobe(wo), i = axes.to_lobe(wi);
  return m.eval(m.side(o), m.side(i), o, i);
}

template <class F, bool kAnisotropic>
inline BsdfSample<F> sample_principled(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo, F u,
                                       F v) {
  const Principled<F, kAnisotropic> m(params, of_kind);
  if constexpr (!kAnisotropic) return m.sample(wo, u, v);
  const LobeAxes<F> axes(select(of_kind, params.p[9], F{}));
  BsdfSample<F> s = m.sample(axes.to_lobe(wo), u, v);
  s.wi = axes.from_lobe(s.wi);
  return s;
}

}  // namespace lightmill
