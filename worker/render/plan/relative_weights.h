#pragma once
// The weight that relMSE gives to the variance of a pixel, 1 / (value^2 + 0.01), from the samples at hand.
//
// 0.01 is for pictures that are shown as they are: what is much darker than 0.1 is not seen well. Pictures in
// photometric units, as those of glTF scenes, have values in the hundreds and are shown with an exposure.
// With 0.01 what is next to black in them would weigh as much as all that is seen. So the number goes with
// the exposure there.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/job/sample_allocation.h"

namespace lightmill {

using Channels = std::array<float, 3>;

/// What is known of the value of a pixel, per channel.
struct PixelValue {
  Channels value{};                         // of its square
  Channels around{};                        // median of the squares around, for what is dark by chance
  float camera_share = 0, splat_share = 0;  // of a camera sample and of a splat in `value`
  float emitter_share = 0;                  // of a splat of a visible emitter
  float epsilon = 0.01f;                    // of relMSE, for the picture as it is shown

  /// No contribution counts for more than this many times its pixel's value: one sample says too little of
  /// what is so rare.
  static constexpr float kMostTimes = 64;
  /// A contribution is bright from this many times its pixel's value on.
  static constexpr float kBright = 2;

  /// A contribution is rare from this many times its pixel's value on: of so few no sequence makes the number
  /// more even.
  static constexpr float kRare = 16;
  float rare(size_t ch) const { return kRare / std::sqrt(weight(ch)); }

  float weight(size_t ch) const { return of(std::max(value[ch], around[ch])); }
  /// The weight for a contribution `x` that makes up the part `share` of the value. If it is much brighter
  /// than the value, the weight goes by the rest of the value: what is rare and bright does not weigh itself
  /// down. Otherwise it is weighed as all else that it is compared with, or little noise would be lost in the
  /// difference.
  float weight_beside(size_t ch, float x, float share) const {
    const float excess = std::max(x - kBright * value[ch], 0.0f);
    const float rest = share < 1 ? value[ch] - excess * share / (1 - share) : 0;
    return of(std::max({rest, around[ch], x / kMostTimes}));
  }
  /// The square of a contribution, each channel weighed by weight_beside.
  double square_beside(const Channels& rgb, float share) const {
    double square = 0;
    for (size_t ch = 0; ch < 3; ++ch) square += double{rgb[ch]} * rgb[ch] * weight_beside(ch, rgb[ch], share);
    return square;
  }

  /// The value less half of a splat `rgb` of a visible emitter, times `noise`, the part of the number of
  /// splats that is chance. Of few splats each weighs itself down; without it, the value would be too small
  /// as often.
  PixelValue beside_half(const float rgb[3], float noise) const {
    PixelValue rest = *this;
    for (size_t ch = 0; ch < 3; ++ch)
      rest.value[ch] = std::max(value[ch] - 0.5f * noise * rgb[ch] * emitter_share, 0.0f);
    return rest;
  }

 private:
  float of(float v) const { return 1 / (v * v + epsilon); }
};

/// Values of small squares of pixels; of single pixels if there are enough samples.
class RelativeWeights {
 public:
  /// Squares have at least `paths` camera paths, where a pixel has `paths_per_pixel` on average. There are at
  /// most kMostSquares. The contributions that give the values are those that are weighed.
  RelativeWeights(const FilmGrid& grid, double paths_per_pixel, double paths);
  /// Pixel (x, y) is one of those that were rendered.
  void preview_cell(int x, int y) { squares_[at(x, y)].pixels += 1; }
  /// Adds a contribution of a camera path, or a splat, to pixel (x, y).
  void add_camera(int x, int y, const Channels& rgb);
  void add_splat(int x, int y, const Channels& rgb);
  /// How much a splat counts, as against a contribution of a camera path. To be set before the first splat.
  void set_per_splat(double times) { per_splat_ = static_cast<float>(times); }
  /// To be called after all contributions.
  void finish();
  PixelValue of(int x, int y) const;
  /// The same, where more is known: `camera` is the sum of `paths` camera paths at the pixel itself, or so
  /// near that no edge is expected in between.
  PixelValue of(int x, int y, const Channels& camera, float paths) const;

  static constexpr int64_t kMostSquares = 1 << 16;

 private:
  struct Square {
    Channels camera{}, splats{}, around{};
    float pixels = 0;
  };
  size_t at(int x, int y) const { return static_cast<size_t>(grid_.at(x, y)); }
  /// The square if any of it was rendered, else all together.
  const Square& known(const Square& s) const { return s.pixels > 0 ? s : all_; }
  float value(const Square& s, size_t ch) const {
    return mean(known(s), known(s).camera[ch] + known(s).splats[ch]);
  }
  /// Mean per pixel sample of a sum over a square.
  float mean(const Square& s, float sum) const {
    return s.pixels > 0 ? sum / (s.pixels * paths_per_pixel_) : 0;
  }

  RegionGrid grid_;
  float paths_per_pixel_, per_splat_ = 0, epsilon_ = 0.01f;
  std::vector<Square> squares_;
  Square all_;
};

}  // namespace lightmill
