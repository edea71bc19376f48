#pragma once
// The error of a mean image, estimated from batches of samples of two replicates (derivation:
// error_estimate.cc).
#include <cstddef>
#include <optional>
#include <span>

#include "common/error/batch_moments.h"

namespace lightmill {

struct ErrorInterval {
  double low = 0, high = 0;
};

/// n times the relMSE of the mean image of n batches against the converged one, and its 95 % interval.
struct BatchError {
  double relmse = 0;
  std::optional<ErrorInterval> interval;  // from kMinIntervalBatches on
  double gain = 1;                        // relmse over that of independent batches
};

/// From n >= 2 batches of equally many samples per pixel. `sums[b]` has 3 width rows sums over `samples`
/// samples each (channels of a pixel together). Batch b is of replicate `replicates[b]`, 0 or 1. If all are
/// of one, they are taken as independent. `expected_gain`: the gain where the two replicates say little.
BatchError estimate_batch_error(std::span<const float* const> sums, std::span<const int> replicates,
                                const PixelLayout& layout, double samples, double expected_gain = 1);

}  // namespace lightmill
