#pragma once
// Textures at render time: images in memory with bilinear lookup, and the small texture graph.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// What is in an image, for emitters that shine by it.
struct ImageContent {
  int width = 0, height = 0;
  Rgb mean;                                 // of all texels, negative ones as 0
  float brightest = 0, darkest = 0;         // of any channel
  int darkest_x = 0, darkest_y = 0;         // where
  int not_finite_x = -1, not_finite_y = 0;  // the first texel that is no number or infinite; -1: none
  bool is_nan = false;                      // which of the two
};

/// An image of RGB or grey texels, linear. Stored as 8-bit sRGB or linear (decoded by a table) or as float.
class ImageMap {
 public:
  /// Throws Error(kBadScene) if the file can't be read.
  explicit ImageMap(const ImageTexture& texture);
  /// Bilinear value (or the nearest texel's) at (s, t), t up. Scale and invert applied.
  Rgb lookup(float s, float t) const;
  /// Looks at every texel.
  ImageContent content() const;
  /// Bounds of lookup()'s channels.
  std::pair<float, float> range() const;
  /// Texels that, as a normal map's, point below the surface or have no direction.
  int64_t inward_normals() const;
  /// x and y of the first texel that is no number or infinite, if there is one; it counts as 0.
  std::optional<std::array<int, 2>> first_not_finite() const;
  /// A bound of lookup()'s channels for s and t within the ranges: 0 only if all texels there are black.
  /// Looks at no more than `limit` texels; infinite if there are more.
  float brightest(float s0, float s1, float t0, float t1, double limit) const;

 private:
  Rgb texel(int x, int y) const;
  int width_ = 0, height_ = 0;
  Wrap wrap_, wrap_t_;
  float scale_;
  bool invert_, nearest_;
  size_t channels_ = 3;         // per texel: 3, or 1 for a grey
  std::vector<uint8_t> bytes_;  // channels_ per texel, or empty
  std::vector<float> floats_;   // channels_ per texel, or empty
  float decode_[256];
  ptrdiff_t not_finite_ = -1;  // index into floats_ of the first value that was not, and became 0
  bool is_nan_ = false;
};

/// Where a texture is looked up.
struct TexturePoint {
  float u = 0, v = 0;                      // surface coordinates
  Vec3d p{};                               // position in scene units
  std::array<float, 4> color{1, 1, 1, 1};  // of the vertices, interpolated
};

/// All textures of a scene, evaluated per point.
class TextureTable {
 public:
  /// Reads the images on `threads` threads (0: one per processor). Throws Error(kBadScene) for the first that
  /// can't be read.
  explicit TextureTable(const std::vector<TextureDescription>& textures, int threads = 1);
  /// Value of texture `id` at a point; floats come as grey.
  Rgb evaluate(int id, const TexturePoint& at) const;
  /// The image behind texture `id`, or null if it is of another kind.
  const ImageMap* image(int id) const {
    const int at = image_of_[static_cast<size_t>(id)];
    return at < 0 ? nullptr : &images_[static_cast<size_t>(at)];
  }
  size_t size() const { return nodes_.size(); }

 private:
  Rgb input(const SpectrumInput& in, const TexturePoint& at) const;
  std::vector<TextureKind> nodes_;
  std::vector<ImageMap> images_;
  std::vector<int> image_of_;  // per node, -1 if it is not an image
};

}  // namespace lightmill
