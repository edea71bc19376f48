#pragma once
// Parameters of layered materials, constant or at a textured point (layered/coated_diffuse.h,
// layered/coated_conductor.h).
#include <array>
#include <map>

#include "worker/render/bsdf/layered/coated_conductor.h"
#include "worker/render/bsdf/layered/coated_diffuse.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// The tables computed for the coats of one scene, which many materials share.
class CoatMemo {
 public:
  /// What one coat makes of a Lambertian base, and its table. With `block`: three rows and a block of
  /// coat_scattering.h, needed if the coat scatters and for the block's other constants. Else: the row of a
  /// rough coat, or nothing for a smooth one.
  struct OverDiffuse {
    std::array<double, 3> returned;
    float entering_mean;
    std::vector<float> table;
  };
  const OverDiffuse& diffuse(const CoatDescription& coat, const CoatMedium& medium, bool block);
  /// The table over a metal of roughness `metal_alpha`: rows and, with `block`, the block. `reflectance`
  /// matters if the coat scatters.
  std::vector<float> conductor(const CoatDescription& coat, const CoatMedium& medium, float metal_alpha,
                               int max_depth, const std::array<float, 3>& reflectance, bool block);

 private:
  std::map<std::array<float, 8>, OverDiffuse> diffuse_;
  std::map<std::array<float, 5>, std::vector<float>> metal_rows_;
  std::map<std::array<float, 11>, std::vector<float>> metal_blocks_;
};

void build_coated_diffuse(const CoatedDiffuseMaterial& material, CoatMemo* coats, RenderScene* scene,
                          MaterialEntry* entry, float* params);
void build_coated_conductor(const CoatedConductorMaterial& material, CoatMemo* coats, RenderScene* scene,
                            MaterialEntry* entry, float* params);

bool is_coated(BsdfKind kind);
/// Overwrites the parameters of a textured material of a coated kind.
void apply_coat_textures(const RenderScene& scene, const MaterialEntry& entry, const TexturePoint& at,
                         float* params);

}  // namespace lightmill
