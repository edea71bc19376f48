#pragma once
// glTF's metallic-roughness material, both sides alike: a Lambertian base under the GGX reflection of a
// dielectric, blended with a metal of the base's colour; and with a clear coat over both.
//
// The specular lobe has Schlick's Fresnel term with the blend of both reflectances, f0 per channel and f90,
// and its energy compensated (metallic_table.h). The base gets what a dielectric's lobe of albedo E leaves,
//   f_d = rho / pi (1 - E(wo)) (1 - E(wi)) / (1 - mean E)
// (Kulla and Conty, "Revisiting Physically Based Shading at Imageworks", 2017): reciprocal, and a white base
// under a lossless dielectric is white; glTF's own sketch, (1 - F) rho / pi, is neither. A coat of weight c
// and albedo E_c lets (1 - c E_c(wo)) (1 - c E_c(wi)) through; what it reflects back inside is left out.
// Reciprocal in all parts. Sheen of colour s and albedo E_s (sheen_table.h) lets min(1 - max s E_s(wo),
// 1 - max s E_s(wi)) through to what is below it, as glTF has it; it is drawn with the base. A thin film
// changes what the specular lobe reflects (iridescence.h), a translucent base lets a part of what it gets
// through to the other side (translucent.h).
//
// Parameters: 0-2 rho / (1 - mean E), 3-5 f0, 6 alpha, 7 f90, 8 the largest f0 of the dielectric (for E),
// 9 the coat (coat_slot). The metallic table is where the tables begin.
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/bsdf/iridescence.h"
#include "worker/render/bsdf/packed_params.h"
#include "worker/render/bsdf/sheen.h"
#include "worker/render/bsdf/tables/metallic_table.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

/// Reflectance of a coat (index 1.5) at normal incidence.
inline constexpr float kCoatF0 = 0.04f;

/// Weight and alpha of a coat in one number: whole steps of the weight, and alpha in (0, 1) as the rest.
inline constexpr float kCoatSteps = 1024;
inline float coat_slot(float weight, float alpha) {
  return static_cast<float>(static_cast<int>(weight * kCoatSteps + 0.5f)) + alpha;
}

/// Of a translucent base: what it transmits, as rho / (1 - mean E), and its share in the choice of the base.
template <class F>
struct Translucence {
  Vec3<F> transmitted;
  F share;
};

template <class F, bool kCoated, class Facets = Ggx<F>>
struct MetallicRoughness {
  const BsdfParams<F>& params;
  F alpha;  // of the tables
  Facets ggx;
  Ggx<F> coat_ggx{};
  F coat{};                               // weight
  const SheenParams<F>* sheen = nullptr;  // what it says of the fibres, if there are any
  const Iridescence<F>* film = nullptr;   // and of a film
  const Translucence<F>* translucence = nullptr;

  MetallicRoughness(const BsdfParams<F>& p, MaskOf<F> of_kind, const SheenParams<F>* fibres = nullptr,
                    const Iridescence<F>* thin_film = nullptr)
      : MetallicRoughness(p, of_kind, Facets{select(of_kind, p.p[6], splat<F>(1.0f))}, fibres, thin_film) {}
  MetallicRoughness(const BsdfParams<F>& p, MaskOf<F> of_kind, const Facets& facets,
                    const SheenParams<F>* fibres, const Iridescence<F>* thin_film)
      : params(p),
        alpha(select(of_kind, p.p[6], splat<F>(1.0f))),
        ggx(facets),
        sheen(fibres),
        film(thin_film) {
    if constexpr (kCoated) {
      const UnpackedSteps<F> packed(p.p[9], of_kind);
      coat = packed.steps * (1 / kCoatSteps);
      coat_ggx.alpha = packed.fraction;
    }
  }

  /// What the lobes do along one direction.
  struct Side {
    F cosine;
    LobeAlbedo<F> lobe;
    F base_share{};                                   // 1 - E
    F coat_share = F{};                               // c E_c
    F sheen_raw = F{}, below_sheen = splat<F>(1.0f);  // E_s before its division, and 1 - max s E_s
    F specular{}, diffuse{}, sum{};                   // of a sampling choice, and with the coat's
    F p_coat() const { return coat_share / sum; }
    F p_specular() const { return specular / sum; }
    F p_diffuse() const { return diffuse / sum; }
  };
  Side side(const Vec3<F>& w) const {
    const F cosine = max(abs(w.z), splat<F>(1e-12f));
    Side s{.cosine = cosine, .lobe = LobeAlbedo<F>(params.tables, cosine, alpha)};
    F of_lobe = film ? film->albedo(cosine) : s.lobe.albedo(params.p[8], params.p[7]);
    if constexpr (requires { ggx.alpha_x; }) {
      const LobeAlbedo<F> wide(params.tables, cosine, ggx.alpha_x);
      of_lobe = max(of_lobe, wide.albedo(params.p[8], params.p[7]));
    }
    s.base_share = 1.0f - of_lobe;
    F through = splat<F>(1.0f);
    if constexpr (kCoated) {
      s.coat_share =
          coat *
          LobeAlbedo<F>(params.tables, cosine, coat_ggx.alpha).albedo(splat<F>(kCoatF0), splat<F>(1.0f));
      through = 1.0f - s.coat_share;
    }
    F of_sheen{};
    if (sheen) {
      const SheenAlbedo<F> fibres(params.tables, cosine, sheen->roughness);
      s.sheen_raw = fibres.raw;
      of_sheen = max_component(sheen->color) * fibres.albedo;
      s.below_sheen = 1.0f - of_sheen;
    }
    s.specular = through * s.below_sheen *
                 (film ? film->lobe_albedo(1.0f - s.base_share)
                       : s.lobe.albedo(max_component(params.rgb(3)), params.p[7]));
    F base = max_component(params.rgb(0));
    if (translucence) base = base + max_component(translucence->transmitted);
    s.diffuse = through * (s.below_sheen * s.base_share * base + of_sheen);
    s.sum = max(s.specular + s.diffuse + s.coat_share, splat<F>(1e-12f));
    return s;
  }

  BsdfEval<F> eval(const Side& o, const Side& i, const Vec3<F>& wo, const Vec3<F>& wi) const {
    const Vec3<F> h = wo + wi;
    const F h2 = dot(h, h);
    const MaskOf<F> valid = MaskOf<F>(h2 > 0.0f);
    const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
    const F facet = min(abs(dot(wo, m)), splat<F>(1.0f));
    const F s = schlick_weight(facet);
    const F d = select(valid, ggx.d(m), F{});
    const F lobe = d * ggx.g(wo, wi) / (4.0f * o.cosine * i.cosine);
    const Vec3<F> f0 = params.rgb(3);
    const F gain = o.lobe.g * i.lobe.g - 1.0f;
    const F at_grazing = params.p[7] * s;
    const auto channel = [&](F r) { return (r * (1.0f - s) + at_grazing) * (1.0f + r * gain) * lobe; };
    BsdfEval<F> e;
    F diffuse_o = o.p_diffuse(), diffuse_i = i.p_diffuse();
    BsdfEval<F> across{};
    if (translucence) {
      F shares = o.base_share * i.base_share * kInvPi;
      if constexpr (kCoated) shares = shares * ((1.0f - o.coat_share) * (1.0f - i.coat_share));
      across = {translucence->transmitted * shares, diffuse_o * translucence->share * i.cosine * kInvPi,
                diffuse_i * translucence->share * o.cosine * kInvPi};
      diffuse_o = diffuse_o * (1.0f - translucence->share);
      diffuse_i = diffuse_i * (1.0f - translucence->share);
    }
    Vec3<F> specular;
    if (film) {
      const Vec3<F> r = film->reflectance(facet);
      const auto filmed = [&](F x) { return x * (1.0f + x * gain) * lobe; };
      specular = {filmed(r.x), filmed(r.y), filmed(r.z)};
    } else {
      specular = {channel(f0.x), channel(f0.y), channel(f0.z)};
    }
    e.f = specular + params.rgb(0) * (o.base_share * i.base_share * kInvPi);
    e.pdf = o.p_specular() * d * ggx.reflection_density(wo) + diffuse_o * i.cosine * kInvPi;
    e.pdf_reverse = i.p_specular() * d * ggx.reflection_density(wi) + diffuse_i * o.cosine * kInvPi;
    if (sheen) {
      e.f = e.f * min(o.below_sheen, i.below_sheen) + sheen->color * fibres(o, i, m, valid);
    }
    if constexpr (kCoated) {
      const F dc = select(valid, coat_ggx.d(m), F{});
      const F fresnel = kCoatF0 + (1.0f - kCoatF0) * s;
      const F reflected = coat * fresnel * dc * coat_ggx.g(wo, wi) / (4.0f * o.cosine * i.cosine);
      e.f = e.f * ((1.0f - o.coat_share) * (1.0f - i.coat_share)) + Vec3<F>{reflected, reflected, reflected};
      e.pdf = e.pdf + o.p_coat() * dc * coat_ggx.reflection_density(wo);
      e.pdf_reverse = e.pdf_reverse + i.p_coat() * dc * coat_ggx.reflection_density(wi);
    }
    const MaskOf<F> reflects = same_side(wo, wi);
    const F one = select(reflects, splat<F>(1.0f), F{});
    e = {e.f * one, e.pdf * one, e.pdf_reverse * one};
    if (!translucence) return e;
    const MaskOf<F> passes = MaskOf<F>(wo.z * wi.z < 0.0f);
    return {select(passes, across.f, e.f), select(passes, across.pdf, e.pdf),
            select(passes, across.pdf_reverse, e.pdf_reverse)};
  }

  /// The part of eval's value that the base and fibres reflect.
  Vec3<F> diffuse(const Side& o, const Side& i, const Vec3<F>& wo, const Vec3<F>& wi) const {
    Vec3<F> f = params.rgb(0) * (o.base_share * i.base_share * kInvPi);
    if (sheen) {
      const Vec3<F> h = wo + wi;
      const F h2 = dot(h, h);
      const MaskOf<F> valid = MaskOf<F>(h2 > 0.0f);
      const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
      f = f * min(o.below_sheen, i.below_sheen) + sheen->color * fibres(o, i, m, valid);
    }
    if constexpr (kCoated) f = f * ((1.0f - o.coat_share) * (1.0f - i.coat_share));
    return f * select(same_side(wo, wi), splat<F>(1.0f), F{});
  }

 private:
  /// Of the sheen at the normal `m` of fibres, 1/sr.
  F fibres(const Side& o, const Side& i, const Vec3<F>& m, MaskOf<F> valid) const {
    const F value = Charlie<F>(sheen->roughness).value(m, o.cosine, i.cosine) /
                    max(splat<F>(1.0f), max(o.sheen_raw, i.sheen_raw));
    return select(valid, value, F{});
  }
};

template <class F, bool kCoated>
inline BsdfEval<F> eval_metallic_roughness(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                           const Vec3<F>& wi) {
  const MetallicRoughness<F, kCoated> m(params, of_kind);
  return m.eval(m.side(wo), m.side(wi), wo, wi);
}

template <class F, bool kCoated, class Facets>
inline BsdfSample<F> sample_metallic_roughness(const MetallicRoughness<F, kCoated, Facets>& material,
                                               const Vec3<F>& wo, F u, F v) {
  const auto o = material.side(wo);
  const MaskOf<F> diffuse = choose_lobe(o.p_diffuse(), &u);
  const F one = splat<F>(1.0f);
  Facets ggx = material.ggx;
  if constexpr (kCoated) {
    const F specular = o.p_specular() / max(1.0f - o.p_diffuse(), splat<F>(1e-12f));
    const MaskOf<F> not_of_coat = choose_lobe(select(diffuse, one, specular), &u);
    ggx = select(mask_not(not_of_coat), material.coat_ggx, ggx);
  }
  MaskOf<F> passes = splat_mask<F>(false);
  if (material.translucence)
    passes = mask_and(diffuse, choose_lobe(select(diffuse, material.translucence->share, one), &u));
  const Vec3<F> up{wo.x, wo.y, abs(wo.z)};
  const Vec3<F> m = ggx.sample_reflecting(up, u, v);
  Vec3<F> wi = select(diffuse, square_to_cosine_hemisphere(u, v), m * (2.0f * dot(up, m)) - up);
  BsdfSample<F> s;
  s.valid = mask_and(MaskOf<F>(wi.z > 0.0f), MaskOf<F>(up.z > 0.0f));
  wi.z = copysign(wi.z, wo.z);
  wi.z = select(passes, -wi.z, wi.z);
  s.wi = wi;
  const BsdfEval<F> e = material.eval(o, material.side(wi), wo, wi);
  s.valid = mask_and(s.valid, MaskOf<F>(e.pdf > 0.0f));
  s.weight = e.f * (abs(wi.z) / select(s.valid, e.pdf, splat<F>(1.0f)));
  s.pdf = e.pdf;
  s.pdf_reverse = e.pdf_reverse;
  s.delta = splat_mask<F>(false);
  return s;
}

template <class F, bool kCoated>
inline BsdfSample<F> sample_metallic_roughness(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                               const Vec3<F>& wo, F u, F v) {
  return sample_metallic_roughness(MetallicRoughness<F, kCoated>(params, of_kind), wo, u, v);
}

/// With sheen, and a coat that may be none.
template <class F>
inline BsdfEval<F> eval_sheen(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                              const Vec3<F>& wi) {
  const SheenParams<F> sheen(params, of_kind);
  const MetallicRoughness<F, true> m(sheen.base, of_kind, &sheen);
  return m.eval(m.side(wo), m.side(wi), wo, wi);
}
template <class F>
inline BsdfSample<F> sample_sheen(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo, F u,
                                  F v) {
  const SheenParams<F> sheen(params, of_kind);
  return sample_metallic_roughness(MetallicRoughness<F, true>(sheen.base, of_kind, &sheen), wo, u, v);
}

/// With a film, and coat and sheen that may be none.
template <class F>
inline BsdfEval<F> eval_iridescent(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                   const Vec3<F>& wi) {
  SheenParams<F> sheen(params, of_kind);
  const Iridescence<F> film(params, of_kind, &sheen.base);
  const MetallicRoughness<F, true> m(sheen.base, of_kind, &sheen, &film);
  return m.eval(m.side(wo), m.side(wi), wo, wi);
}
template <class F>
inline BsdfSample<F> sample_iridescent(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo, F u,
                                       F v) {
  SheenParams<F> sheen(params, of_kind);
  const Iridescence<F> film(params, of_kind, &sheen.base);
  return sample_metallic_roughness(MetallicRoughness<F, true>(sheen.base, of_kind, &sheen, &film), wo, u, v);
}

}  // namespace lightmill
