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
// Measured by tests/bench/planning/error_coverage on a caustic with a relMSE of 0.9 at 16 spp: the estimate
// from 4 batches is 20 % too high, from 18 4 %, where the pixels alone with or without caps on them gave
// anything from 1/17 to 1.9 times the truth. On the five other scenes the bias is below 1 %.
//
// Of the error itself the 24 pixels around are asked, without whom light that comes in very rare events is
// overestimated by half. For how pixels move together (tau, error_estimate.cc) it is the 8 next ones: further
// away R is another one, and a few pixels with far too small denominators then make most of tau; on that
// caustic the interval would be a sixth wider.
#include "common/error/error_weights.h"

#include <array>

namespace lightmill {
namespace {

constexpr size_t kChannels = 3;

/// Sums of M, M^2 and t over some pixels, by channel. In double: values go in and out of a sum, and what is
/// left must not be what rounding left of a firefly.
struct PixelSums {
  std::array<double, kChannels> m{}, m2{}, t{};
};

void add(const PixelSums& of, double sign, PixelSums* to) {
  for (size_t c = 0; c < kChannels; ++c) {
    to->m[c] += sign * of.m[c];
    to->m2[c] += sign * of.m2[c];
    to->t[c] += sign * of.t[c];
  }
}

}  // namespace

void neighbourhood(std::span<const float> mean, std::span<const float> variance, const PixelLayout& layout,
                   const PixelReach& reach, Neighbourhood* around) {
  const size_t row = kChannels * layout.width;
  around->square.resize(row * layout.rows);
  around->noise.resize(row * layout.rows);
  // Vertical sums, moved from row to row; then horizontal ones.
  std::vector<PixelSums> columns(layout.width);
  const auto add_row = [&](size_t y, double sign) {
    for (size_t x = 0; x < layout.width; ++x) {
      for (size_t c = 0; c < kChannels; ++c) {
        const size_t at = y * row + kChannels * x + c;
        const double value = mean[at];
        columns[x].m[c] += sign * value;
        columns[x].m2[c] += sign * value * value;
        columns[x].t[c] += sign * static_cast<double>(variance[at]);
      }
    }
  };
  for (size_t y = 0; y < std::min(reach.rows, layout.rows); ++y) add_row(y, 1);
  for (size_t y = 0; y < layout.rows; ++y) {
    if (y + reach.rows < layout.rows) add_row(y + reach.rows, 1);
    const size_t above = std::min(y, reach.rows), below = std::min(layout.rows - 1 - y, reach.rows);
    PixelSums sum;
    for (size_t x = 0; x < std::min(reach.columns, layout.width); ++x) add(columns[x], 1, &sum);
    for (size_t x = 0; x < layout.width; ++x) {
      if (x + reach.columns < layout.width) add(columns[x + reach.columns], 1, &sum);
      const size_t left = std::min(x, reach.columns), right = std::min(layout.width - 1 - x, reach.columns);
      const auto others = static_cast<double>((above + below + 1) * (left + right + 1) - 1);
      // A picture of one pixel has nothing around: it is its own neighbour.
      const double share = 1 / std::max(others, 1.0), without = others > 0 ? 1.0 : 0.0;
      for (size_t c = 0; c < kChannels; ++c) {
        const size_t at = y * row + kChannels * x + c;
        const double own = mean[at], t = variance[at];
        const double mean_m = (sum.m[c] - without * own) * share,
                     mean_m2 = (sum.m2[c] - without * own * own) * share,
                     mean_t = std::max(0.0, (sum.t[c] - without * t) * share);
        around->square[at] = static_cast<float>(std::max(mean_m * mean_m, mean_m2 - mean_t));
        around->noise[at] = static_cast<float>(mean_t);
      }
      if (x >= reach.columns) add(columns[x - reach.columns], -1, &sum);
    }
    if (y >= reach.rows) add_row(y - reach.rows, -1);
  }
}

}  // namespace lightmill
