#pragma once
// Second moments of the batches of an image: all that its error estimate needs of the pixels
// (error_estimate.cc).
#include <cstddef>
#include <span>
#include <vector>

namespace lightmill {

/// With fewer batches their spread says too little, and there is no interval.
inline constexpr size_t kMinIntervalBatches = 4;

/// The size of a pixel's neighbourhood, to each side.
struct PixelReach {
  size_t columns = 0, rows = 0;
  bool operator==(const PixelReach&) const = default;
};

/// How the pixels of a batch lie beside each other: `rows` rows of `width`. A pixel is judged by those within
/// `reach`. Its part in how pixels vary together is judged by those that are `near` (error_weights.cc).
struct PixelLayout {
  size_t width = 0, rows = 0;
  PixelReach reach{2, 2}, near{1, 1};
};

/// Means over pixels and channels, weighted as in relMSE, of n batches.
struct BatchMoments {
  explicit BatchMoments(size_t count) : d(count), gram(count * count) {}
  std::vector<double> d;     // d_b: the square of batch b's deviation from the mean, times n/(n-1)
  std::vector<double> gram;  // G_bc: the product of two batches' deviations; upper triangle, n x n
  double at(size_t b, size_t c) const { return gram[b < c ? b * d.size() + c : c * d.size() + b]; }
};

/// `sums[b]` has 3 width rows sums over 1 / `to_mean` samples each (channels of a pixel together). At least
/// two batches.
BatchMoments batch_moments(std::span<const float* const> sums, const PixelLayout& layout, double to_mean);

}  // namespace lightmill
