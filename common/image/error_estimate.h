#pragma once
// The error of a mean image, estimated from independent batches of samples (derivation: error_estimate.cc).
#include <cstddef>
#include <span>

namespace lightmill {

/// Expected relMSE of one batch's image, with the half-width of its 95 % interval. The image of k times as
/// many samples has 1/k of both.
struct BatchError {
  double relmse = 0;
  double half_width = 0;
};

/// From n >= 2 batches of equally many samples per pixel: `sums[b]` has `values` sums over `samples` samples
/// each (pixels x channels).
BatchError estimate_batch_error(std::span<const float* const> sums, size_t values, double samples);

/// 97.5 % quantile of Student's t with `dof` >= 1 degrees of freedom: half-width of a 95 % interval.
double student_t_975(int dof);

}  // namespace lightmill
