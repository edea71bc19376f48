#pragma once
// Materials as a scene file describes them.
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "common/scene/materials/blender_materials.h"
#include "common/scene/texture_description.h"

namespace lightmill {

/// Roughness as pbrt has it: alpha = remap ? sqrt(roughness) : roughness, per tangent direction.
struct Roughness {
  FloatInput u, v;
  bool remap = true;
};

struct DiffuseMaterial {
  SpectrumInput reflectance{{0.5f, 0.5f, 0.5f}, -1};
};
/// Lambertian reflection and transmission, both sides alike. Values are times `scale`; where a channel's sum
/// is above 1, the renderer scales both down to a sum of 1.
struct DiffuseTransmissionMaterial {
  SpectrumInput reflectance{{0.25f, 0.25f, 0.25f}, -1}, transmittance{{0.25f, 0.25f, 0.25f}, -1};
  float scale = 1;
};
/// Fresnel by eta, k; or, if `reflectance` is set, by pbrt's rule eta = 1, k = 2 sqrt(r) / sqrt(1 - r).
struct ConductorMaterial {
  SpectrumInput eta, k;
  std::optional<SpectrumInput> reflectance;
  Roughness roughness;
};
struct DielectricMaterial {
  float eta = 1.5f;
  Roughness roughness;
};
/// A smooth sheet too thin to shift what is seen through it; `eta` over its surroundings.
struct ThinDielectricMaterial {
  float eta = 1.5f;
};
/// What is in a coat: the single-scattering albedo and the asymmetry g, in (-1, 1), of Henyey-Greenstein's
/// phase function. Black: the coat absorbs alone.
struct CoatMediumDescription {
  Rgb albedo;
  float g = 0;
};
/// Diffuse base under a dielectric coat, pbrt's layered model: a traversal of the coat at cosine mu transmits
/// exp(-thickness / mu), and at most max_depth interactions with coat and base are followed (those with the
/// medium are not counted).
struct CoatedDiffuseMaterial {
  SpectrumInput reflectance{{0.5f, 0.5f, 0.5f}, -1};
  float eta = 1.5f;
  Roughness roughness;
  float thickness = 0.01f;
  int max_depth = 10;
  CoatMediumDescription medium{};
};
/// Metal under a dielectric coat; the coat as above. `conductor` is the metal against air, as pbrt has it.
struct CoatedConductorMaterial {
  ConductorMaterial conductor;
  float eta = 1.5f;  // of the coat
  Roughness coat_roughness;
  float thickness = 0.01f;
  int max_depth = 10;
  CoatMediumDescription medium{};
};
/// At every point either materials[0] or, with probability `amount`, materials[1] (indices into
/// SceneDescription::materials; they may be mixes, too).
///
/// Blender's rules weigh what the chosen one scatters, so that it stands for both: kMixShader has
/// (1 - amount) of the first and `amount` of the second, kAddShader all of both. Those of a Principled BSDF
/// have all of its first part, which weighs itself, and of the second, its glass or its body:
/// kTransmission amount (1 - metallic), kBody (1 - amount) (1 - metallic).
enum class MixRule { kChance, kMixShader, kAddShader, kTransmission, kBody };
struct MixMaterial {
  std::array<int, 2> materials{-1, -1};
  FloatInput amount{0.5f, -1};
  MixRule rule = MixRule::kChance;
  FloatInput metallic{0, -1};  // kTransmission, kBody
  bool coated = false;         // kTransmission: the first part shines however much is transmitted
};
/// glTF's material: a diffuse base under a dielectric's specular reflection, blended with a metal of the
/// base's colour; a clear coat over both. GGX with alpha = roughness^2. The dielectric reflects min(1,
/// f0(ior) specular_color) specular at normal incidence and `specular` at grazing; ior 0 means f0 = 1. Sheen,
/// of fibres, lies on the base and below the coat; black: none. A thin film of index `iridescence_ior` may
/// lie on base and metal by the weight `iridescence`, its thickness (nm) going from the first to the second
/// figure with the input `iridescence_thickness` in [0, 1]. With an anisotropy s of up to 1 the lobe's alpha
/// is alpha + (1 - alpha) s^2 along a direction, which is `anisotropy_rotation` turns from dp/du towards
/// dp/dv; a texture's red and green, 2 x - 1, are a direction before that rotation, and blue multiplies s. Of
/// what gets to the diffuse base a share `translucence` is let through in `translucent_color`.
struct MetallicRoughnessMaterial {
  SpectrumInput base_color{{1, 1, 1}, -1};
  FloatInput metallic{1, -1}, roughness{1, -1};
  float ior = 1.5f;
  FloatInput specular{1, -1};
  SpectrumInput specular_color{{1, 1, 1}, -1};
  FloatInput clearcoat{0, -1}, clearcoat_roughness{0, -1};
  SpectrumInput sheen_color{{0, 0, 0}, -1};
  FloatInput sheen_roughness{0, -1};
  FloatInput iridescence{0, -1}, iridescence_thickness{1, -1};
  float iridescence_ior = 1.3f;
  std::array<float, 2> iridescence_nm{100, 400};
  float anisotropy = 0, anisotropy_rotation = 0;
  int anisotropy_texture = -1;
  FloatInput translucence{0, -1};
  SpectrumInput translucent_color{{1, 1, 1}, -1};
};
/// glTF's transmission: an interface that tints what it lets through. Thin: a sheet of which light comes out
/// in the direction in which it entered, spread by the roughness; else light is refracted into a solid of
/// index `ior`. GGX with alpha = roughness^2.
struct TransmissionMaterial {
  SpectrumInput color{{1, 1, 1}, -1};
  FloatInput roughness{0, -1};
  float ior = 1.5f;
  bool thin = true;
};
/// A fibre by Chiang et al. 2016: sigma_a per fibre radius; roughnesses along the fibre (beta_m) and around
/// it (beta_n) in [0.01, 1]; scales tilted by `alpha_degrees`. With `reflectance` (of a mass of fibres)
/// sigma_a follows from it and beta_n.
struct HairMaterial {
  SpectrumInput sigma_a{{0.5447f, 0.9061f, 1.781f}, -1};  // eumelanin 1.3
  std::optional<SpectrumInput> reflectance;
  float eta = 1.55f, beta_m = 0.3f, beta_n = 0.3f, alpha_degrees = 2;
};
/// A dielectric boundary over a medium that scatters (Henyey and Greenstein, mean cosine g in (-1, 1)) and
/// fills the shape: light enters it and leaves it elsewhere. Coefficients are per scene unit, any scale
/// applied. With `reflectance`, of a flat and deep body of the medium besides what its boundary reflects,
/// they follow from it and from `mfp`, the mean free path in scene units. A textured reflectance holds below
/// each point of the surface.
struct SubsurfaceMaterial {
  Rgb sigma_a{.0011f, .0024f, .014f}, sigma_s{2.55f, 3.21f, 3.77f};
  std::optional<SpectrumInput> reflectance;
  Rgb mfp{1, 1, 1};
  float g = 0, eta = 1.33f;
  Roughness roughness;
};
/// A measured BRDF, reflecting on both sides; null: black.
struct MeasuredTable;
struct MeasuredMaterial {
  std::shared_ptr<const MeasuredTable> table;
};
using MaterialKind =
    std::variant<DiffuseMaterial, ConductorMaterial, DielectricMaterial, CoatedDiffuseMaterial,
                 ThinDielectricMaterial, DiffuseTransmissionMaterial, CoatedConductorMaterial, MixMaterial,
                 MetallicRoughnessMaterial, TransmissionMaterial, HairMaterial, MeasuredMaterial,
                 SubsurfaceMaterial, PrincipledMaterial, ClosureMaterial>;
struct MaterialDescription {
  std::string name;  // empty for an unnamed Material
  MaterialKind kind;
  SourceLocation location;
  /// Index of a texture that turns the shading normal: 2 rgb - 1 in the frame of dp/du, of the normal, and of
  /// their cross product. -1: none.
  int normal_map = -1;
  float normal_scale = 1;         // of the map's x and y
  bool normal_follows_v = false;  // glTF: y points along +v even where u and v are mirrored
  /// Index of a float texture of heights (scene units) along the normal that tilts the shading normal alone.
  /// -1: none. What a normal map or a graph gives is tilted.
  int displacement = -1;
  /// Blender's: slopes of the heights over a pixel's width rather than over a small step of u and v, and how
  /// much of the tilt is kept (above 1: more than all).
  bool bump_by_pixel = false;
  FloatInput bump_strength{1, -1};
  /// Index of a texture graph that is the shading normal, in the space "world" of the graph and not of unit
  /// length; the zero vector stands for the surface's own. -1: none. Goes before a normal map.
  int shading_normal = -1;
  /// Index of a texture graph that anisotropic lobes of Blender lie along instead of dp/du, likewise. -1:
  /// none.
  int tangent = -1;
  /// The share of rays that the surface stops, in [0, 1], because it is made of Transparent BSDFs in part:
  /// the other parts have their weights over it. Set by cut_out_transparent().
  FloatInput opacity{1, -1};
  /// The colour of what passes, if it is none of the greys. Set likewise.
  Rgb tint{1, 1, 1};
};
/// Whether light gets another colour where it passes the material.
inline bool is_tinted(const MaterialDescription& m) { return !(m.tint == Rgb{1, 1, 1}); }

}  // namespace lightmill
