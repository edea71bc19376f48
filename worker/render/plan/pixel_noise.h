#pragma once
// The variance of pixels, from the samples of one cell of the film.
#include <array>
#include <numeric>
#include <vector>

#include "worker/render/pipeline/recording/strategy_recorder.h"

namespace lightmill {

/// Per channel, the variance of the sum of a pixel's samples: that of one sample times their number.
struct PixelNoise {
  uint32_t pixel = 0;
  std::array<double, 3> variance{};
};

/// Sums up what camera paths bring to the pixels of a cell, sample by sample.
class CameraSums {
 public:
  void add(const StrategyContribution& c) {
    for (size_t ch = 0; ch < 3; ++ch) sample_[static_cast<size_t>(c.slot)][ch] += double{c.rgb[ch]};
  }
  void end_sample() {
    for (size_t slot = 0; slot < sample_.size(); ++slot) {
      for (size_t ch = 0; ch < 3; ++ch) {
        const double x = sample_[slot][ch];
        sum_[slot][ch] += x;
        squares_[slot][ch] += x * x;
      }
      sample_[slot] = {};
    }
  }
  /// Noise of the pixels that have any, after `samples` >= 2 samples.
  std::vector<PixelNoise> noise(const FilmGrid& grid, const CellRect& rect, int64_t samples) const {
    const auto n = static_cast<double>(samples);
    std::vector<PixelNoise> noise;
    for (size_t slot = 0; slot < sum_.size(); ++slot) {
      const int x = rect.x0 * kCellSize + static_cast<int>(slot) % kCellSize,
                y = rect.y0 * kCellSize + static_cast<int>(slot) / kCellSize;
      PixelNoise p;
      p.pixel = static_cast<uint32_t>(y) * static_cast<uint32_t>(grid.width) + static_cast<uint32_t>(x);
      for (size_t ch = 0; ch < 3; ++ch)
        p.variance[ch] =
            n / (n - 1) * std::max(squares_[slot][ch] - sum_[slot][ch] * sum_[slot][ch] / n, 0.0);
      if (std::accumulate(p.variance.begin(), p.variance.end(), 0.0) > 0) noise.push_back(p);
    }
    return noise;
  }

 private:
  using Pixels = std::vector<std::array<double, 3>>;
  Pixels sample_ = Pixels(kCellPixels), sum_ = sample_, squares_ = sample_;
};

}  // namespace lightmill
