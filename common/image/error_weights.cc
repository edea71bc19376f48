// Denominators.
//
// f(M) = 1 / (M^2 + e) is not f(R): M has the variance t. E[f(M)] = f(R) + f''(R) t/2 + O(t^2) with
// f''(x)/2 = (3 x^2 - e) f(x)^3. Where R^2 << e the noise makes f(M) too small (E[M^2] = R^2 + t: dark pixels
// look bright), where R^2 >> e it makes it too large (1/x^2 is convex). Hence to first order in t
//
//   w = f(M) / (1 + z)          for z >= 0,
//   w = min(1/e, f(M) (1 - z))  for z < 0,     z = t (3 M^2 - e) f(M)^2.
//
// That helps while t is small against M^2 + e. Where a pixel's light comes in rare events (caustics), M says
// nothing: the batches that have seen an event make R look large, and their own error small; those that have
// not make it look like 0. There the pixels around are asked, of which some have seen it: the mean of R^2
// over a neighbourhood without the pixel is the larger of (mean of M)^2, which ignores how R varies there,
// and mean of (M^2 - t), which is unbiased but noisy. R^2 is the mean of both opinions. With x the noise (the
// larger one of the pixel's and of its neighbours': a pixel that has seen no event does not know its noise)
// over R^2 + e, the neighbours have the share x^2 / ((x + 0.3) (x + 0.03)): next to nothing below a relative
// noise of a tenth, where edges and textures would make them wrong by more than the correction, and most of
// it above one half.
//
// Measured by tests/bench/error_coverage on a caustic with a relMSE of 0.9 at 16 spp: the estimate from 4
// batches is 20 % too high, from 18 4 %, where the pixels alone with or without caps on them gave anything
// from 1/17 to 1.9 times the truth. On the five other scenes the bias is below 1 %.
//
// Of the error itself the 24 pixels around are asked, without whom light that comes in very rare events is
// overestimated by half. For how pixels move together (tau, error_estimate.cc) it is the 8 next ones: further
// away R is another one, and a few pixels with far too small denominators then make most of tau; on that
// caustic the interval would be a sixth wider.
#include "common/image/error_weights.h"

namespace lightmill {
namespace {

/// sums[i] = sum of `values` over the indices [i - reach, i + reach] within [0, size), all times `stride`.
template <class In, class Out>
void sliding_sum(size_t size, size_t reach, const In& value, const Out& put) {
  double sum = 0;
  for (size_t i = 0; i < std::min(reach, size); ++i) sum += value(i);
  for (size_t i = 0; i < size; ++i) {
    if (i + reach < size) sum += value(i + reach);
    put(i, sum);
    if (i >= reach) sum -= value(i - reach);
  }
}

}  // namespace

Neighbourhood neighbourhood(std::span<const float> mean, std::span<const float> variance,
                            const PixelLayout& layout, const PixelReach& reach) {
  const size_t row = 3 * layout.width, size = row * layout.rows;
  Neighbourhood around;
  around.square.resize(size);
  around.noise.resize(size);
  // Vertical sums of M, M^2 and t, moved from row to row; then horizontal ones. Kept in double: values go in
  // and out of a sum, and what is left must not be what rounding left of a firefly.
  std::vector<double> m(row), m2(row), v(row);
  const auto add = [&](size_t y, double sign) {
    for (size_t i = 0; i < row; ++i) {
      const double value = mean[y * row + i];
      m[i] += sign * value;
      m2[i] += sign * value * value;
      v[i] += sign * static_cast<double>(variance[y * row + i]);
    }
  };
  std::vector<double> sum_m(row), sum_m2(row), sum_v(row);
  for (size_t y = 0; y < std::min(reach.rows, layout.rows); ++y) add(y, 1);
  for (size_t y = 0; y < layout.rows; ++y) {
    if (y + reach.rows < layout.rows) add(y + reach.rows, 1);
    for (size_t c = 0; c < 3; ++c) {
      const auto across = [&](const std::vector<double>& from, std::vector<double>* to) {
        sliding_sum(
            layout.width, reach.columns, [&](size_t x) { return from[3 * x + c]; },
            [&](size_t x, double sum) { (*to)[3 * x + c] = sum; });
      };
      across(m, &sum_m);
      across(m2, &sum_m2);
      across(v, &sum_v);
    }
    const size_t above = std::min(y, reach.rows), below = std::min(layout.rows - 1 - y, reach.rows);
    for (size_t x = 0; x < layout.width; ++x) {
      const size_t left = std::min(x, reach.columns), right = std::min(layout.width - 1 - x, reach.columns);
      const auto others = static_cast<double>((above + below + 1) * (left + right + 1) - 1);
      for (size_t i = 3 * x; i < 3 * x + 3; ++i) {
        const size_t at = y * row + i;
        const double own = mean[at], t = variance[at];
        // A picture of one pixel has nothing around: it is its own neighbour.
        const double n = std::max(others, 1.0), without = others > 0 ? 1.0 : 0.0;
        const double mean_m = (sum_m[i] - without * own) / n, mean_m2 = (sum_m2[i] - without * own * own) / n,
                     mean_t = std::max(0.0, (sum_v[i] - without * t) / n);
        around.square[at] = static_cast<float>(std::max(mean_m * mean_m, mean_m2 - mean_t));
        around.noise[at] = static_cast<float>(mean_t);
      }
    }
    if (y >= reach.rows) add(y - reach.rows, -1);
  }
  return around;
}

}  // namespace lightmill
