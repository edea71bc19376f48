#pragma once
// The closed set of BSDFs, over a lane type.
//
// Directions are unit vectors in the shading frame (z = shading normal), both pointing away from the
// surface. `wo` is where the path came from, `wi` where it goes. Every value states its measure:
//   f            BSDF value, 1/sr, without the cosine
//   pdf          density of sampling wi given wo, per unit solid angle (of the non-delta lobes)
//   pdf_reverse  density of sampling wo given wi, same measure
//   weight       f |cos wi| / pdf of the sampled direction; for delta lobes the ratio of the deltas
// Mode::kRadiance scales transmitted light by 1/eta^2 (camera paths); Mode::kImportance does not (light
// paths): Veach 1997 §5.2, pbrt-v4 §9.5.2.
//
// eval_bsdf() and sample_bsdf() (bsdf_dispatch.h) take a kind per lane.
#include "worker/render/math/vec.h"

namespace lightmill {

enum class Mode { kRadiance, kImportance };

/// Kinds as stored with a vertex. Values index the counting sort of the bouncer.
using BsdfKind = int32_t;
inline constexpr BsdfKind kDiffuse = 0, kRoughConductor = 1, kSmoothConductor = 2, kSmoothDielectric = 3,
                          kRoughDielectric = 4, kSmoothCoated = 5, kRoughCoated = 6, kThinDielectric = 7,
                          kDiffuseTransmission = 8, kSmoothCoatedConductor = 9, kCoatedConductor = 10,
                          kRoughCoatedConductor = 11, kAnisotropicConductor = 12, kAnisotropicDielectric = 13,
                          kMetallicRoughness = 14, kCoatedMetallicRoughness = 15, kTintedDielectric = 16,
                          kRoughTintedDielectric = 17, kTintedSheet = 18, kRoughTintedSheet = 19,
                          kSheenMetallicRoughness = 20, kHair = 21, kScatteringCoated = 22,
                          kRoughScatteringCoated = 23, kScatteringCoatedConductor = 24,
                          kRoughScatteringCoatedConductor = 25, kMeasured = 26, kAnisotropicCoated = 27,
                          kAnisotropicCoatedConductor = 28, kAnisotropicRoughCoatedConductor = 29,
                          kSubsurface = 30, kRoughSubsurface = 31, kIridescent = 32,
                          kAnisotropicMetallicRoughness = 33, kTranslucent = 34, kPrincipled = 35,
                          kAnisotropicPrincipled = 36, kOrenNayar = 37, kGlossy = 38, kAnisotropicGlossy = 39,
                          kSharpGlass = 40, kRoughGlass = 41, kVelvet = 42, kToon = 43, kBsdfKinds = 44;
/// Of a material alone: a vertex has the kind of what the mix is there. Sorts after the others.
inline constexpr BsdfKind kMix = kBsdfKinds, kMaterialKinds = kBsdfKinds + 1;
/// Of a vertex in a medium (henyey_greenstein.h); no material has it.
inline constexpr BsdfKind kPhaseFunction = kMaterialKinds;
/// Of a vertex where light leaves a body that it has walked through (subsurface.h); no material has them.
inline constexpr BsdfKind kSubsurfaceExit = kMaterialKinds + 1, kRoughSubsurfaceExit = kMaterialKinds + 2;

/// True if every lobe is a delta: no connection can be made at such a vertex.
constexpr bool is_pure_delta(int32_t kind) {
  return kind == kSmoothConductor || kind == kSmoothDielectric || kind == kThinDielectric ||
         kind == kSmoothCoatedConductor || kind == kTintedDielectric || kind == kTintedSheet ||
         kind == kSharpGlass;
}
/// True if some lobe is a delta.
constexpr bool has_delta(int32_t kind) {
  return is_pure_delta(kind) || kind == kSmoothCoated || kind == kCoatedConductor ||
         kind == kScatteringCoated || kind == kScatteringCoatedConductor ||
         kind == kAnisotropicCoatedConductor || kind == kSubsurface;
}
/// True for glTF's metallic roughness, whatever lies over it.
constexpr bool is_metallic_roughness(int32_t kind) {
  return kind == kMetallicRoughness || kind == kCoatedMetallicRoughness || kind == kSheenMetallicRoughness ||
         kind == kIridescent || kind == kAnisotropicMetallicRoughness || kind == kTranslucent;
}
/// True if light may enter a body there and leave it elsewhere.
template <class F>
inline MaskOf<F> enters_bodies(IntOf<F> kind) {
  return mask_or(MaskOf<F>(kind == kSubsurface), MaskOf<F>(kind == kRoughSubsurface));
}
/// True where light has left one.
template <class F>
inline MaskOf<F> leaves_bodies(IntOf<F> kind) {
  return mask_or(MaskOf<F>(kind == kSubsurfaceExit), MaskOf<F>(kind == kRoughSubsurfaceExit));
}
/// is_pure_delta per lane.
template <class F>
inline MaskOf<F> pure_delta(IntOf<F> kind) {
  const auto either = [&](BsdfKind a, BsdfKind b) {
    return mask_or(MaskOf<F>(kind == a), MaskOf<F>(kind == b));
  };
  return mask_or(
      mask_or(either(kTintedDielectric, kTintedSheet), MaskOf<F>(kind == kSharpGlass)),
      mask_or(either(kSmoothConductor, kSmoothDielectric), either(kThinDielectric, kSmoothCoatedConductor)));
}

/// Which lanes have a lobe that follows the tangent.
template <class F>
inline MaskOf<F> anisotropic(IntOf<F> kind) {
  const auto either = [&](BsdfKind a, BsdfKind b) {
    return mask_or(MaskOf<F>(kind == a), MaskOf<F>(kind == b));
  };
  const MaskOf<F> gltf = MaskOf<F>(kind == kAnisotropicMetallicRoughness);
  const MaskOf<F> blender = either(kAnisotropicPrincipled, kAnisotropicGlossy);
  return mask_or(mask_or(mask_or(gltf, blender), either(kAnisotropicConductor, kAnisotropicDielectric)),
                 mask_or(mask_or(either(kHair, kMeasured), MaskOf<F>(kind == kAnisotropicCoated)),
                         either(kAnisotropicCoatedConductor, kAnisotropicRoughCoatedConductor)));
}

/// Roughness below which a microfacet lobe is its delta limit.
inline constexpr float kSmoothAlpha = 1e-3f;

inline constexpr int kBsdfParams = 10;
/// Parameters of any kind, in slots:
///   diffuse     0-2 reflectance, 3-5 transmittance (of diffuse transmission)
///   conductor   0-2 eta, 3-5 k, 6 alpha, 7 table row + 1 of energy compensation or 0
///   dielectric  0 eta, 6 alpha (thin: eta alone)
///   anisotropic as conductor, dielectric and coated kinds, and 8 and 9 as anisotropic.h says
///   hair as hair.h and measured as measured.h says, and 9 as anisotropic.h says
///   metallic roughness as metallic_roughness.h says, with a film as iridescence.h; tinted as tinted.h;
///   anisotropic ones as brushed.h says, translucent ones as translucent.h
///   coated      0-2 base (coated_base), 3 eta, 4 mean entering transmittance, 5 thickness, 6 alpha,
///               8 table row (rough: entering transmittance; scattering: that of each channel, and a block
///               of coat_scattering.h)
///   coated conductor, all smooth
///               0-2 eta and 3-5 k of the metal over the coat, 7 eta of the coat, 8 thickness
///   coated conductor, rough
///               0-2 F0 of the metal in the coat, 3 eta of the coat, 4 rise of F, 5 thickness, 6 alpha of the
///               metal seen through the coat, 7 alpha of the coat, 8 table row (coated_conductor.h;
///               scattering: a block of coat_scattering.h follows)
///   Blender's as the headers of blender/ say
///   subsurface, of both sides of the walk
///               0-2 single-scattering albedo, 3, 4, 6 and 8 as coated, 7 number of the body
///               (subsurface_body.h)
template <class F>
struct BsdfParams {
  F p[kBsdfParams]{};
  const float* tables = nullptr;  // RenderScene::bsdf_tables, into which table rows point
  Vec3<F> rgb(int slot) const { return {p[slot], p[slot + 1], p[slot + 2]}; }
};

template <class F>
struct BsdfEval {
  Vec3<F> f;
  F pdf{}, pdf_reverse{};
};

template <class F>
struct BsdfSample {
  Vec3<F> wi;
  Vec3<F> weight;
  F pdf{}, pdf_reverse{};             // of the non-delta lobes; 1 for a delta event
  F roulette_scale = splat<F>(1.0f);  // undoes the 1/eta^2 of radiance for Russian roulette
  MaskOf<F> valid{};
  MaskOf<F> delta{};
};

/// Chooses one of two lobes by `u`, the first with probability `p`. Returns where it is the first, and
/// stretches `u` over the part that was chosen. So one number of a path chooses the lobe and its direction,
/// and the two are stratified together.
template <class F>
inline MaskOf<F> choose_lobe(F p, F* u) {
  const MaskOf<F> first = MaskOf<F>(*u < p);
  const F begin = select(first, F{}, p), size = select(first, p, 1.0f - p);
  *u = min((*u - begin) / max(size, splat<F>(1e-12f)), splat<F>(1.0f - 0x1p-24f));
  return first;
}

template <class F>
inline MaskOf<F> same_side(const Vec3<F>& a, const Vec3<F>& b) {
  return MaskOf<F>(a.z * b.z > 0.0f);
}

}  // namespace lightmill
