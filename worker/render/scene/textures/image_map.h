#pragma once
// An image texture's texels, and bilinear look-ups in them.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/scene/description.h"
#include "worker/render/scene/textures/texture_cache.h"

namespace lightmill {

/// What is in an image, for emitters that shine by it.
struct ImageContent {
  int width = 0, height = 0;
  Rgb mean;                                 // of all texels, negative ones as 0
  float brightest = 0, darkest = 0;         // of any channel
  int darkest_x = 0, darkest_y = 0;         // where
  int not_finite_x = -1, not_finite_y = 0;  // the first texel that is NaN or infinite; -1: none
  bool is_nan = false;                      // which of the two
};

/// An image of RGB or grey texels, linear. It is stored as 8-bit sRGB or linear (decoded by a table) or as
/// float, or read through a TextureCache.
class ImageMap {
 public:
  /// Throws Error(kBadScene) if the file can't be read. With a `cache`, which must outlive the image, all
  /// texels are checked but not kept.
  explicit ImageMap(const ImageTexture& texture, TextureCache* cache = nullptr);
  /// Memory that an image's texels would take, from its header. Throws as the constructor.
  static uint64_t bytes_needed(const ImageTexture& texture);
  /// Value at (s, t), t up. Scale and invert applied.
  Rgb lookup(float s, float t) const;
  /// Begins to fetch what lookup(s, t) will read.
  void prefetch(float s, float t) const;
  /// Reads every texel.
  ImageContent content() const;
  /// Bounds of lookup()'s channels.
  std::pair<float, float> range() const;
  /// Number of texels that, as a normal map's, point below the surface or have no direction.
  int64_t inward_normals() const;
  /// x and y of the first texel that is NaN or infinite, if there is one. It counts as 0.
  std::optional<std::array<int, 2>> first_not_finite() const;
  /// A bound of lookup()'s channels for s and t within the ranges: 0 only if all texels there are black.
  /// Reads `limit` texels at most; infinite if there are more.
  float brightest(float s0, float s1, float t0, float t1, double limit) const;

  bool cached() const { return cache_ != nullptr; }

 private:
  /// Finds the first texel that is not finite; false if not all can be read.
  bool look_at_all();
  /// A stored value made linear; 0 if it is not finite.
  float decoded(float stored) const;
  Rgb color(const uint8_t* texel) const;
  Rgb color(const float* texel) const;
  Rgb texel(int x, int y) const;
  /// The same for indices that were wrapped; -1: black.
  Rgb stored_texel(int x, int y) const;
  /// Texels (x, y) to (x + 1, y + 1), row by row.
  std::array<Rgb, 4> square(int x, int y) const;
  /// The cubic B-spline of the texels around the one at (x, y), `dx` and `dy` beyond its centre.
  Rgb cubic(int x, int y, float dx, float dy) const;
  /// Index of the first channel. Not for a cached image.
  size_t index_of(int x, int y) const {
    return channels_ * (static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x));
  }
  /// The texel at or before (s, t). `dx`, `dy`: how far the point is from its centre, in texels.
  std::array<int, 2> texel_before(float s, float t, float* dx, float* dy) const;
  template <class Value>
  bool read_cached(int x0, int x1, int y0, int y1, Value* out) const;
  /// Calls visit(x, y, colour) for all texels, row by row.
  template <class Visit>
  void for_each_texel(const Visit& visit) const;

  int width_ = 0, height_ = 0;
  Wrap wrap_, wrap_t_;
  float scale_;
  bool invert_;
  TexelFilter filter_;
  bool is_bytes_ = false;
  size_t channels_ = 3;         // per texel: 3, or 1 for a grey
  std::vector<uint8_t> bytes_;  // channels_ per texel, or empty
  std::vector<float> floats_;   // channels_ per texel, or empty
  TextureCache* cache_ = nullptr;
  TextureCache::File file_;   // in the cache
  int first_channel_ = 0;     // of those in the file; they are read_channels_
  size_t read_channels_ = 0;  // 0: opaque alpha
  ColorEncoding encoding_;    // never kAuto
  float gamma_;
  float decode_[256];
  int64_t not_finite_ = -1;  // index of the first texel that was not finite, and became 0
  bool is_nan_ = false;
};

}  // namespace lightmill
