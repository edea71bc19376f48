#pragma once
// Blender's shader nodes as materials, with the names and defaults of its sockets; how they scatter is what
// Cycles 3.4 makes of them (docs/blender-materials.md).
#include <array>

#include "common/scene/texture_description.h"

namespace lightmill {

/// Distributions of facets, by which glossy lobes and glass are rough.
enum class FacetShape { kGgx, kMultiGgx, kBeckmann, kAshikhminShirley, kSharp };

/// The Principled BSDF. Where light goes through its surface (transmission) or below it (subsurface), the
/// reader makes several materials of one node and mixes them (MixRule): `part` says which. kSurface is
/// kOpaque without the diffuse lobe.
struct PrincipledMaterial {
  enum class Part { kOpaque, kSurface, kGlass };
  Part part = Part::kOpaque;
  SpectrumInput base_color{{0.8f, 0.8f, 0.8f}, -1};
  FloatInput metallic{0, -1}, specular{0.5f, -1}, specular_tint{0, -1}, roughness{0.5f, -1};
  FloatInput anisotropic{0, -1}, anisotropic_rotation{0, -1};
  FloatInput sheen{0, -1}, sheen_tint{0.5f, -1};
  FloatInput clearcoat{0, -1}, clearcoat_roughness{0.03f, -1};
  FloatInput ior{1.45f, -1}, transmission{0, -1}, transmission_roughness{0, -1};
  bool multi_ggx = false;
};

/// A closure of one lobe or two. `roughness` is that of its node, `second` what else it has: a Toon's smooth,
/// an anisotropic lobe's anisotropy.
enum class ClosureKind {
  kDiffuse,
  kGlossy,
  kGlass,
  kRefraction,
  kTranslucent,
  kTransparent,
  kVelvet,
  kToon,
  kHoldout
};
struct ClosureMaterial {
  ClosureKind closure = ClosureKind::kDiffuse;
  SpectrumInput color{{0.8f, 0.8f, 0.8f}, -1};
  FloatInput roughness{0, -1};   // of Velvet its sigma, of Toon its size
  FloatInput anisotropy{0, -1};  // of Toon its smooth
  FloatInput rotation{0, -1};    // turns
  FloatInput ior{1.45f, -1};
  FacetShape facets = FacetShape::kGgx;
  bool glossy = false;  // Toon
};

}  // namespace lightmill
