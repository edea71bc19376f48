#pragma once
// The error of a mean image, estimated from batches of samples of two replicates (derivation:
// error_estimate.cc).
#include <cstddef>
#include <optional>
#include <span>

namespace lightmill {

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

/// n times the relMSE of the mean image of n batches against the converged one, and the half-width of its 95
/// % interval.
struct BatchError {
  double relmse = 0;
  std::optional<double> half_width;  // from kMinIntervalBatches on
};

/// With fewer batches their spread says too little, and there is no interval.
inline constexpr size_t kMinIntervalBatches = 4;

/// From n >= 2 batches of equally many samples per pixel. `sums[b]` has 3 width rows sums over `samples`
/// samples each (channels of a pixel together). Batch b is of replicate `replicates[b]`, 0 or 1. If all are
/// of one, they are taken as independent.
BatchError estimate_batch_error(std::span<const float* const> sums, std::span<const int> replicates,
                                const PixelLayout& layout, double samples);

/// 97.5 % quantile of Student's t with `dof` >= 1 degrees of freedom: half-width of a 95 % interval.
double student_t_975(int dof);

}  // namespace lightmill
