#pragma once
// Texture references of glTF materials: images, samplers, texture transforms, and the factors that go with
// them.
#include <array>

#include "common/scene/gltf/accessors.h"

namespace lightmill {

class GltfTextures {
 public:
  GltfTextures(GltfScene& scene, GltfBuffers& buffers, const GltfValue& root)
      : scene_(scene), buffers_(buffers), root_(root) {}

  /// Textures from here on are of one material, which can have two sets of texture coordinates. The first is
  /// the normal map's, whose tangents follow it.
  void begin_material(const GltfValue& material);
  /// The set that the material's textures use, and another one; -1: there is none.
  int uv_set() const { return uv_sets_[0] < 0 ? 0 : uv_sets_[0]; }
  int second_uv_set() const { return uv_sets_[1]; }
  /// Some image is used.
  bool used() const { return used_; }

  /// Index into the scene's textures of the texture that member `key` of `owner` refers to, one channel of it
  /// times `scale` (alpha: 1 where the image has none); -1 if absent, or reported and left out. `srgb`:
  /// colours are decoded.
  int image(const GltfValue& owner, const char* key, ImageChannel channel, bool srgb, float scale = 1,
            bool invert = false);
  /// Factor times texture.
  SpectrumInput color(const GltfValue& owner, const char* key, const Rgb& factor);
  FloatInput number(const GltfValue& owner, const char* key, ImageChannel channel, float factor);
  /// a times b, where -1 stands for 1.
  int product(int a, int b);
  int add(TextureKind kind, const GltfValue& at, bool is_spectrum);

 private:
  struct Image {
    std::string path;
    std::shared_ptr<const std::string> contents;
  };
  const Image& source(size_t index);
  /// True (and warned of) for an image that is not there where that is no error.
  bool is_missing(const GltfValue& image);

  GltfScene& scene_;
  GltfBuffers& buffers_;
  GltfValue root_;
  std::map<size_t, Image> images_;
  std::array<int, 2> uv_sets_{-1, -1};
  bool used_ = false;
};

}  // namespace lightmill
