#pragma once
// Which part of a reflection is diffuse (common/job/lobes.h). It is a function of the two directions alone,
// the same for all strategies that evaluate or sample them.
//
//   diffuse alone   diffuse, Oren-Nayar, velvet, toon's diffuse form, what leaves a body, and what is not a
//                   sharp reflection of a base below a smooth coat
//   of both         a base below a rough coat, glTF's metallic roughness, Blender's Principled BSDF: what the
//                   base, fibres and a coat's medium have of f
//   glossy alone    all others, as path_kinds.h has it for rays: metals, glass, lacquered metal with what its
//                   coat scatters, measured surfaces, hair
#include "worker/render/bsdf/bsdf_dispatch.h"

namespace lightmill {

/// Of what the kind scatters with a density.
constexpr bool reflects_diffusely_alone(BsdfKind kind) {
  return kind == kDiffuse || kind == kDiffuseTransmission || kind == kOrenNayar || kind == kVelvet ||
         kind == kSmoothCoated || kind == kScatteringCoated || kind == kSubsurfaceExit ||
         kind == kRoughSubsurfaceExit;
}
constexpr bool reflects_both_ways(BsdfKind kind) {
  return kind == kRoughCoated || kind == kRoughScatteringCoated || kind == kAnisotropicCoated ||
         kind == kPrincipled || kind == kAnisotropicPrincipled || is_metallic_roughness(kind);
}

namespace diffuse_share_detail {

template <class F, bool kScattering>
inline Vec3<F> below_coat(const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                          const Vec3<F>& wi) {
  const CoatedDiffuse<F, true, kScattering, false> coat{params, of_kind};
  return coat.diffuse(coat.side(wo), coat.side(wi));
}

template <class F, class Material>
inline Vec3<F> below_lobe(const Material& m, const Vec3<F>& wo, const Vec3<F>& wi) {
  return m.diffuse(m.side(wo), m.side(wi), wo, wi);
}

/// The diffuse part of f, for a kind that reflects both ways.
template <class F>
inline Vec3<F> diffuse_part(BsdfKind kind, const BsdfParams<F>& params, MaskOf<F> of_kind, const Vec3<F>& wo,
                            const Vec3<F>& wi) {
  switch (kind) {
    case kRoughCoated:
      return below_coat<F, false>(params, of_kind, wo, wi);
    case kRoughScatteringCoated:
    case kAnisotropicCoated:  // its base does not know of the tangent
      return below_coat<F, true>(params, of_kind, wo, wi);
    case kPrincipled:
      return below_lobe<F>(Principled<F, false>(params, of_kind), wo, wi);
    case kAnisotropicPrincipled:
      return below_lobe<F>(Principled<F, true>(params, of_kind), wo, wi);
    case kMetallicRoughness:
      return below_lobe<F>(MetallicRoughness<F, false>(params, of_kind), wo, wi);
    case kCoatedMetallicRoughness:
      return below_lobe<F>(MetallicRoughness<F, true>(params, of_kind), wo, wi);
    case kSheenMetallicRoughness: {
      const SheenParams<F> sheen(params, of_kind);
      return below_lobe<F>(MetallicRoughness<F, true>(sheen.base, of_kind, &sheen), wo, wi);
    }
    case kIridescent: {
      SheenParams<F> sheen(params, of_kind);
      const Iridescence<F> film(params, of_kind, &sheen.base);
      return below_lobe<F>(MetallicRoughness<F, true>(sheen.base, of_kind, &sheen, &film), wo, wi);
    }
    case kAnisotropicMetallicRoughness: {
      const BrushedParams<F> brushed(params, of_kind);
      return below_lobe<F>(brushed.material(of_kind), brushed.axes.to_lobe(wo), brushed.axes.to_lobe(wi));
    }
    case kTranslucent: {
      const TranslucentParams<F> translucent(params, of_kind);
      return below_lobe<F>(translucent.material(of_kind), wo, wi);
    }
    default:
      return {};
  }
}

}  // namespace diffuse_share_detail

/// The part of f(wo, wi) that is diffuse, in [0, 1] for each channel, where `wi` is on the side of `wo`; 0
/// for lanes that are not active. Not of a delta lobe, which has none.
template <class F>
[[gnu::noinline]] Vec3<F> diffuse_share(IntOf<F> kind, MaskOf<F> active, const BsdfParams<F>& params,
                                        const Vec3<F>& wo, const Vec3<F>& wi) {
  Vec3<F> share{}, part{};
  MaskOf<F> both = splat_mask<F>(false);
  for_each_kind<F>(kind, active, [&](int32_t k, MaskOf<F> m) {
    if (reflects_both_ways(k)) {
      part = select(m, diffuse_share_detail::diffuse_part<F>(k, params, m, wo, wi), part);
      both = mask_or(both, m);
      return;
    }
    if (k == kToon) m = mask_and(m, mask_not(MaskOf<F>(params.p[8] > 0.0f)));
    if (k == kToon || reflects_diffusely_alone(k)) share = select(m, splat3<F>(1, 1, 1), share);
  });
  if (!any(both)) return share;
  const Vec3<F> f = eval_bsdf<F>(kind, both, params, wo, wi, Mode::kRadiance).f;
  const auto channel = [](F diffuse, F whole) {
    const MaskOf<F> some = MaskOf<F>(whole > 0.0f);
    return select(some, clamp(diffuse / select(some, whole, splat<F>(1.0f)), 0.0f, 1.0f), F{});
  };
  return select(both, {channel(part.x, f.x), channel(part.y, f.y), channel(part.z, f.z)}, share);
}

}  // namespace lightmill
