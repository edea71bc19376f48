#pragma once
// glTF materials and the extensions to them.
#include "common/scene/gltf/textures.h"

namespace lightmill {

/// What a primitive takes over from its material.
struct GltfSurface {
  int material = -1;
  int area_light = -1;
  FloatInput alpha{1, -1};
  int uv_set = 0, second_uv_set = -1;  // TEXCOORD_n; -1: none
  bool textured = false;
  MediumInterface media{};  // a volume that absorbs, inside
  bool invisible = false;   // alpha is 0 everywhere
};

class GltfMaterials {
 public:
  GltfMaterials(GltfScene& scene, GltfTextures& textures, const GltfValue& root)
      : scene_(scene), textures_(textures), root_(root) {}

  /// Material `index` (-1: glTF's default) for meshes with or without vertex colours. What can't be used is
  /// reported once.
  const GltfSurface& surface(int index, bool vertex_colors);

 private:
  GltfSurface translate(const GltfValue& material, bool vertex_colors);
  MaterialKind bsdf(const GltfValue& material, const SpectrumInput& base, const GltfValue& metal_rough);
  void transmit(const GltfValue& material, MaterialDescription* description, GltfSurface* surface);
  MediumInterface volume(const GltfValue& volume);
  FloatInput alpha(const GltfValue& material, const GltfValue& base, const char* texture, float factor,
                   bool vertex_colors);
  void unlit(const GltfValue& material, const SpectrumInput& color, MaterialDescription* description,
             GltfSurface* surface);
  void emission(const GltfValue& material, GltfSurface* surface);
  void name_unsupported(const GltfValue& material);

  GltfScene& scene_;
  GltfTextures& textures_;
  GltfValue root_;
  std::map<std::pair<int, bool>, GltfSurface> surfaces_;
};

/// Names of the extensions that the reader knows; a file that requires another is refused.
bool knows_gltf_extension(const std::string& name);

}  // namespace lightmill
