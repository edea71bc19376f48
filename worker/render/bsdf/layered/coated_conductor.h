#pragma once
// Metal under a dielectric coat, both sides alike: pbrt's layered model (pbrt-v4 §14.3), evaluated in closed
// form so that value and densities are exact and deterministic.
//
// With F(w) the coat's reflectance, w' the direction refracted into it, e(w) = exp(-t / |cos w'|) the loss of
// one traversal and T(w) = (1 - F(w)) e(w):
//
// All smooth. Every path leaves in the mirror direction; with rho the metal's reflectance at |cos w'|
//   R = F + (1 - F)^2 e^2 rho (1 + rho F e^2 + ...) = F + T^2 rho / (1 - rho F e^2)
// is the whole series: exact (pbrt stops it after maxdepth).
//
// Rough. The coat's own reflection is a delta or GGX. What has met the metal once is, for a smooth coat,
//   f_1(wo, wi) = T(wo) T(wi) f_metal(wo', wi') / eta^2
// exactly: radiance in the coat is eta^2 times that outside, and cos' dw' = cos dw / eta^2. A rough coat
// tilts the light on its way in and out; its normals, of slope s, tilt a refracted direction by s (1 -
// 1/eta), half of which counts as a tilt of the metal: the slopes of three facets add, and the one GGX that
// stands for their sum has its peak (coated_conductor_alpha).
//
// What meets the metal again after the coat's inside has thrown it back keeps the shape of f_1:
//   f = g(wo) g(wi) f_1
// where g, per channel by the metal's reflectance, is the row that gives f the directional albedo of the
// random walk through both interfaces (layered_walk.h, albedo_table.h). T of a rough coat is taken at
// facet_cosine; g makes up for what is left of that, too.
//
// Against pbrt, which estimates its walk stochastically: the first order is the same for a smooth coat; the
// later ones have the right energy in every direction but the lobe of the first; a rough coat blurs by one
// GGX lobe instead of two refractions. Reciprocal by form.
//
// A coat that scatters adds a lobe of its own, drawn by the cosine (coat_scattering.h); what it takes from
// the others is in e.
#include <array>

#include "worker/render/bsdf/bsdf.h"
#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/ggx.h"
#include "worker/render/bsdf/layered/coat_scattering.h"
#include "worker/render/bsdf/tables/albedo_table.h"
#include "worker/render/math/exp.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

/// alpha of the metal as seen through the coat.
float coated_conductor_alpha(float eta, float coat_alpha, float metal_alpha);
/// F0 of the metal in the coat per channel, and the common rise: F(c) = F0 + rise (1 - F0)^3 (1 - c)^2 for
/// the cosines c at the metal's facets, which refraction keeps away from grazing; within 0.01 there. eta and
/// k are those over the coat.
void coated_conductor_fresnel(const float eta[3], const float k[3], float coat_eta, float f0[3], float* rise);
/// kReflectanceNodes rows of g, for reflectances i / (kReflectanceNodes - 1). Alphas at or below kSmoothAlpha
/// mean smooth.
inline constexpr int kReflectanceNodes = 5;
std::array<CosineRow, kReflectanceNodes> coated_conductor_rows(float eta, float thickness, float coat_alpha,
                                                               float metal_alpha, int max_depth);

template <class F>
inline BsdfSample<F> sample_smooth_coated_conductor(const BsdfParams<F>& params, const Vec3<F>& wo) {
  F cos_t;
  const F r = fresnel_dielectric(abs(wo.z), params.p[7], &cos_t);
  const F e = exp_negative(-params.p[8] / max(cos_t, splat<F>(1e-6f)));
  const F e2 = e * e, t2 = (1.0f - r) * (1.0f - r) * e2;
  const Vec3<F> rho = fresnel_conductor(cos_t, params.rgb(0), params.rgb(3));
  // At grazing incidence 1 - rho F e^2 tends to 0 only together with T.
  const auto total = [&](F c) { return r + t2 * c / max(1.0f - c * r * e2, splat<F>(1e-12f)); };
  BsdfSample<F> s;
  s.wi = {-wo.x, -wo.y, wo.z};
  s.weight = {total(rho.x), total(rho.y), total(rho.z)};
  s.pdf = s.pdf_reverse = splat<F>(1.0f);
  s.valid = MaskOf<F>(wo.z != 0.0f);
  s.delta = splat_mask<F>(true);
  return s;
}

template <class F, bool kRough, bool kScattering, bool kAnisotropic>
struct CoatedConductor {
  const BsdfParams<F>& params;
  MaskOf<F> of_kind;

  /// A direction outside, with what happens at the coat. All on the upper side.
  struct Side : CoatSide<F> {
    F reflectance, to_metal;  // F and T
  };
  Side side(const Vec3<F>& w) const {
    Side s;
    s.cosine = max(abs(w.z), splat<F>(1e-12f));
    F cos_t;
    s.reflectance = fresnel_dielectric(min(s.cosine, splat<F>(1.0f)), params.p[3], &cos_t);
    const F inv = 1.0f / params.p[3];
    s.inside = {w.x * inv, w.y * inv, max(cos_t, splat<F>(1e-6f))};
    if constexpr (kRough)
      s.reflectance = fresnel_dielectric(facet_cosine(w, params.p[7]), params.p[3], &cos_t);
    s.transmittance = 1.0f - s.reflectance;
    s.to_metal = s.transmittance * exp_negative(-params.p[5] / max(cos_t, splat<F>(1e-6f)));
    return s;
  }
  /// Reflectance of the metal's facets at cosine c.
  Vec3<F> metal(F c) const {
    const F x = 1.0f - c;
    const F rise = params.p[4] * x * x;
    const auto one = [&](F f0) {
      const F dark = 1.0f - f0;
      return clamp(f0 + dark * dark * dark * rise, 0.0f, 1.0f);
    };
    return {one(params.p[0]), one(params.p[1]), one(params.p[2])};
  }
  /// g(wo) g(wi) per channel.
  Vec3<F> returns(const Side& o, const Side& i) const {
    const CosinePlace<F> po(o.cosine), pi(i.cosine);
    const IntOf<F> first = table_row(params, 8, of_kind);
    const auto one = [&](F rho) {
      const F x = clamp(rho, 0.0f, 1.0f) * static_cast<float>(kReflectanceNodes - 1);
      const IntOf<F> node = to_int(min(x, splat<F>(kReflectanceNodes - 2)));
      const F t = x - to_float(node);
      const IntOf<F> row = first + node * kCosineNodes;
      const auto g = [&](const CosinePlace<F>& p) {
        const F a = p.in(params.tables, row), b = p.in(params.tables, row + kCosineNodes);
        return a + (b - a) * t;
      };
      return g(po) * g(pi);
    };
    return {one(params.p[0]), one(params.p[1]), one(params.p[2])};
  }
  CoatScattering<F> scattering() const {
    return {params.tables, table_row(params, 8, of_kind) + kReflectanceNodes * kCosineNodes};
  }
  auto metal_lobe() const {
    if constexpr (kAnisotropic) {
      return anisotropic_lobe(params.p[6], scattering().constant(kBaseAnisotropy));
    } else {
      return Ggx<F>{params.p[6]};
    }
  }
  auto lobe() const {
    if constexpr (kAnisotropic) {
      return anisotropic_lobe(params.p[7], scattering().constant(kCoatAnisotropy));
    } else {
      return Ggx<F>{params.p[7]};
    }
  }
  /// Probabilities of the lobes: of the coat's own, and of what it scatters.
  struct Lobes {
    F coat, scattered;
    F metal() const { return 1.0f - coat - scattered; }
  };
  Lobes lobes(const Side& o) const {
    const F base = o.to_metal * max_component(params.rgb(0));
    F scattered{};
    if constexpr (kScattering) scattered = o.transmittance * scattering().constant(4);
    const F inv = 1.0f / max(o.reflectance + base + scattered, splat<F>(1e-12f));
    return {o.reflectance * inv, scattered * inv};
  }
};

template <class F, bool kRough, bool kScattering, bool kAnisotropic = false>
inline BsdfEval<F> eval_coated_conductor(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                                         const Vec3<F>& wi) {
  const CoatedConductor<F, kRough, kScattering, kAnisotropic> coat{params, of_kind};
  const auto o = coat.side(wo), i = coat.side(wi);
  const auto po = coat.lobes(o), pi = coat.lobes(i);
  const F inv_eta2 = 1.0f / (params.p[3] * params.p[3]);
  BsdfEval<F> e;
  {
    const auto ggx = coat.metal_lobe();
    const Vec3<F> m = normalize(o.inside + i.inside);
    const F d = ggx.d(m);
    const F c = min(abs(dot(o.inside, m)), splat<F>(1.0f));
    const F four = 4.0f * o.inside.z * i.inside.z;
    e.f = coat.metal(c) * coat.returns(o, i) *
          (o.to_metal * i.to_metal * inv_eta2 * d * ggx.g(o.inside, i.inside) / four);
    // dw' / dw = cos / (eta^2 cos').
    e.pdf = po.metal() * d * ggx.g1(o.inside) * i.cosine * inv_eta2 / four;
    e.pdf_reverse = pi.metal() * d * ggx.g1(i.inside) * o.cosine * inv_eta2 / four;
  }
  if constexpr (kScattering) {
    e.f = e.f + coat.scattering().f(o, i, params.p[3], params.p[5]);
    e.pdf = e.pdf + po.scattered * i.cosine * kInvPi;
    e.pdf_reverse = e.pdf_reverse + pi.scattered * o.cosine * kInvPi;
  }
  if constexpr (kRough) {
    const auto ggx = coat.lobe();
    const Vec3<F> h = wo + wi;
    const F h2 = dot(h, h);
    const MaskOf<F> valid = MaskOf<F>(h2 > 0.0f);
    const Vec3<F> m = h * (1.0f / sqrt(select(valid, h2, splat<F>(1.0f))));
    const F d = select(valid, ggx.d(m), F{});
    F unused;
    const F r = fresnel_dielectric(min(abs(dot(wo, m)), splat<F>(1.0f)), params.p[3], &unused);
    const F spec = d * ggx.g(wo, wi) * r / (4.0f * o.cosine * i.cosine);
    e.f = e.f + Vec3<F>{spec, spec, spec};
    e.pdf = e.pdf + po.coat * d * ggx.reflection_density(wo);
    e.pdf_reverse = e.pdf_reverse + pi.coat * d * ggx.reflection_density(wi);
  }
  const F one = select(same_side(wo, wi), splat<F>(1.0f), F{});
  return {e.f * one, e.pdf * one, e.pdf_reverse * one};
}

template <class F, bool kRough, bool kScattering, bool kAnisotropic = false>
inline BsdfSample<F> sample_coated_conductor(const BsdfParams<F>& params, MaskOf<F> of_kind,
                                             const Vec3<F>& wo, F u, F v) {
  const CoatedConductor<F, kRough, kScattering, kAnisotropic> coat{params, of_kind};
  const Vec3<F> up{wo.x, wo.y, abs(wo.z)};
  const auto o = coat.side(up);
  const auto po = coat.lobes(o);
  const MaskOf<F> choose_coat = choose_lobe(po.coat, &u);
  const F eta = params.p[3];
  MaskOf<F> scatter = splat_mask<F>(false);
  if constexpr (kScattering) {
    const F scattered = po.scattered / max(1.0f - po.coat, splat<F>(1e-12f));
    scatter =
        mask_and(mask_not(choose_coat), choose_lobe(select(choose_coat, splat<F>(1.0f), scattered), &u));
  }
  // The metal's lobe: reflect inside, refract out; nothing leaves beyond the critical angle.
  const auto base = coat.metal_lobe();
  const Vec3<F> m = base.sample_visible(o.inside, u, v);
  const Vec3<F> inner = m * (2.0f * dot(o.inside, m)) - o.inside;
  const Vec3<F> flat{inner.x * eta, inner.y * eta, F{}};
  const F out2 = 1.0f - dot(flat, flat);
  Vec3<F> wi{flat.x, flat.y, safe_sqrt(out2)};
  MaskOf<F> valid = mask_and(MaskOf<F>(inner.z > 0.0f), MaskOf<F>(out2 > 0.0f));
  if constexpr (kScattering) {
    wi = select(scatter, square_to_cosine_hemisphere(u, v), wi);
    valid = mask_or(valid, scatter);
  }
  BsdfSample<F> s;
  if constexpr (kRough) {
    const auto ggx = coat.lobe();
    const Vec3<F> n = ggx.sample_reflecting(up, u, v);
    const Vec3<F> reflected = n * (2.0f * dot(up, n)) - up;
    wi = select(choose_coat, reflected, wi);
    valid =
        mask_or(mask_and(choose_coat, MaskOf<F>(reflected.z > 0.0f)), mask_and(mask_not(choose_coat), valid));
    s.delta = splat_mask<F>(false);
  } else {
    wi = select(choose_coat, Vec3<F>{-up.x, -up.y, up.z}, wi);
    s.delta = choose_coat;
  }
  wi.z = copysign(wi.z, wo.z);
  s.wi = wi;
  const BsdfEval<F> e =
      eval_coated_conductor<F, kRough, kScattering, kAnisotropic>(params, of_kind, wo, s.wi);
  s.valid = mask_and(MaskOf<F>(up.z > 0.0f), mask_or(s.delta, mask_and(valid, MaskOf<F>(e.pdf > 0.0f))));
  const F scale = abs(s.wi.z) / select(MaskOf<F>(e.pdf > 0.0f), e.pdf, splat<F>(1.0f));
  const F coat_weight = o.reflectance / max(po.coat, splat<F>(1e-12f));
  s.weight = select(s.delta, Vec3<F>{coat_weight, coat_weight, coat_weight}, e.f * scale);
  s.pdf = select(s.delta, splat<F>(1.0f), e.pdf);
  s.pdf_reverse = select(s.delta, splat<F>(1.0f), e.pdf_reverse);
  return s;
}

}  // namespace lightmill
