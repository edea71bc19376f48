// Cross-validation between halves.
//
// A = R + a and B = R + b are the halves, with independent errors of mean 0; F_A = R + f and F_B = R + g what
// the filter made of them; the picture is (F_A + F_B) / 2. Then
//
//   (F_A - F_B)^2 / 4 + (A - F_A) (B - F_B)  =  ((f + g) / 2)^2 + a b - f b - g a
//
// The left side is known. The first term on the right is the squared error, and the others have the mean 0 if
// f knows nothing of b, and g nothing of a. So the residuals of the halves have for their covariance what
// both filters do wrong alike, the square of the bias; the spread of the filtered halves has the variance.
//
// f knows a little of b, for shares of filters are chosen, and fireflies found, by comparing halves. With
// E[f b] > 0 the estimate is too low. By how much, a second run says in which B has lost a quarter of its
// pixels, squares of 4x4 that have values of F_A in their place. What F_A becomes there, F_A', knows nothing
// of b there, so that E[f b] = E[(F_A - F_A') b], and b is B - F_A' but for the error of F_A', which is small
// where b matters. That holds for fireflies, too, to whose presence filters respond in no way that
// derivatives would show. By symmetry E[g a] is the same.
//
// Light in few events has another trap. Filters take it for fireflies, so that the picture is too dark all
// over, but hardly a pixel has an event in both halves, and without one the product of residuals there is
// nothing. Means over boxes of 16x16 pixels show it: the product of the mean residuals has the square of the
// mean bias as its mean, which is less than the mean of the square, and much less noise. The estimate is no
// less than that.
//
// The interval. The estimate errs by the sum of a b - f b - g a and of what the probe errs by. Sums over
// boxes of 16x16 pixels are taken as independent with mean 0, which makes the sum of their squares the
// variance: the square of the bias, which is in them too, widens the interval a little. Light that came in
// few events makes few boxes count, and the degrees of freedom of Student's t say so (Satterthwaite, "An
// Approximate Distribution of Estimates of Variance Components", 1946, with fourth moments in place of known
// variances).
#include "common/image/denoise/cross_validation.h"

#include <algorithm>
#include <cmath>

#include "common/base/statistics/student_t.h"
#include "common/image/denoise/blend.h"

namespace lightmill::denoise {

namespace {

constexpr int kBoxSide = 16;
constexpr size_t kMinBoxes = 16;
constexpr double kMinNoisyPixels = 100;
constexpr int kSquareSide =
    4;  // of what is left out, every other one on both axes: noise of neighbours goes together
constexpr int kOneOf = 4;  // pixels is left out

float weight_of(float fa, float fb) {
  const float mean = 0.5f * (fa + fb);
  return 1 / (mean * mean + kRelativeFloor);
}

size_t boxes_along(int pixels) { return static_cast<size_t>((pixels + kBoxSide - 1) / kBoxSide); }

/// Sums over the boxes, those at the right and lower border cut.
std::vector<double> box_sums(const Extent& extent, const auto& value) {
  const size_t columns = boxes_along(extent.width);
  std::vector<double> sums(columns * boxes_along(extent.height));
  for (int y = 0; y < extent.height; ++y) {
    for (int x = 0; x < extent.width; ++x) {
      sums[static_cast<size_t>(y / kBoxSide) * columns + static_cast<size_t>(x / kBoxSide)] +=
          value(extent.at(x, y));
    }
  }
  return sums;
}

/// How many pixels of equal noise would have as much scatter.
double noisy_pixels(const Plane& noise) {
  double sum = 0, squares = 0;
  for (const float n : noise) sum += double{n}, squares += double{n} * double{n};
  return squares > 0 ? sum * sum / squares : 0;
}

bool is_left_out(int x, int y) { return x / kSquareSide % 2 == 1 && y / kSquareSide % 2 == 1; }

/// Half-width of the 95 % interval of the sum of such sums.
double half_width(const std::vector<double>& sums) {
  double squares = 0, fourths = 0;
  for (const double s : sums) squares += s * s, fourths += s * s * s * s;
  if (!(fourths > 0)) return 0;
  // The variance's variance is 2 sum sigma^4 for normal sums, and their fourth moments are 3 sigma^4.
  const double freedom = std::clamp(3 * squares * squares / fourths, 1.0, 1e6);
  return student_t_975(static_cast<int>(freedom)) * std::sqrt(squares);
}

std::vector<double> smooth_bias(const Extent& extent, const Halves& halves, const Halves& filtered) {
  std::vector<double> result;
  const std::vector<double> pixels = box_sums(extent, [](size_t) { return 1.0; });
  result.resize(pixels.size());
  for (int c = 0; c < 3; ++c) {
    const auto residuals = [&](int h) {
      return box_sums(extent, [&](size_t i) {
        const float weight = weight_of(filtered.of[0].c[c][i], filtered.of[1].c[c][i]);
        return double{std::sqrt(weight)} * double{halves.of[h].c[c][i] - filtered.of[h].c[c][i]};
      });
    };
    const std::vector<double> a = residuals(0), b = residuals(1);
    for (size_t k = 0; k < result.size(); ++k) result[k] += a[k] * b[k] / (3 * pixels[k]);
  }
  return result;
}

}  // namespace

ErrorPlanes estimate_error(const Extent& extent, const Halves& halves, const Halves& filtered, int threads) {
  ErrorPlanes error;
  for (Plane* plane : {&error.noise, &error.squared, &error.relative, &error.spread})
    plane->resize(extent.pixels());
  for_rows(extent, threads, [&](int y) {
    const size_t begin = extent.at(0, y), end = begin + static_cast<size_t>(extent.width);
    for (int c = 0; c < 3; ++c) {
      const Plane &fa = filtered.of[0].c[c], &fb = filtered.of[1].c[c];
      const Plane &a = halves.of[0].c[c], &b = halves.of[1].c[c];
      for (size_t i = begin; i < end; ++i) {
        const float half = 0.5f * (fa[i] - fb[i]), spread = half * half * (1.0f / 3);
        const float squared = spread + (a[i] - fa[i]) * (b[i] - fb[i]) * (1.0f / 3);
        const float weight = weight_of(fa[i], fb[i]);
        error.noise[i] += (a[i] - b[i]) * (a[i] - b[i]) * weight * (0.25f / 3);
        error.squared[i] += squared;
        error.relative[i] += squared * weight;
        error.spread[i] += spread * weight;
      }
    }
  });
  error.smooth_bias = smooth_bias(extent, halves, filtered);
  return error;
}

Colour without_some_pixels(const Extent& extent, const Colour& half, const Colour& instead) {
  Colour result = half;
  for (int y = 0; y < extent.height; ++y) {
    for (int x = 0; x < extent.width; ++x) {
      const size_t i = extent.at(x, y);
      for (int c = 0; c < 3 && is_left_out(x, y); ++c) result.c[c][i] = instead.c[c][i];
    }
  }
  return result;
}

Plane knowledge_of_other(const Extent& extent, const Halves& halves, const Halves& filtered,
                         const Colour& probed, int threads) {
  Plane known(extent.pixels());
  // Of both halves, for those pixels that were not left out, too.
  constexpr float kAll = 2.0f * kOneOf;
  for_rows(extent, threads, [&](int y) {
    for (int c = 0; c < 3; ++c) {
      const Plane &fa = filtered.of[0].c[c], &fb = filtered.of[1].c[c], &b = halves.of[1].c[c];
      for (int x = 0; x < extent.width; ++x) {
        const size_t i = extent.at(x, y);
        if (!is_left_out(x, y)) continue;
        known[i] += (fa[i] - probed.c[c][i]) * (b[i] - probed.c[c][i]) * weight_of(fa[i], fb[i]) * (kAll / 3);
      }
    }
  });
  return known;
}

RelmseEstimate estimate_relmse(const Extent& extent, const ErrorPlanes& error, const Plane& known) {
  const auto pixels = static_cast<double>(extent.pixels());
  const auto known_at = [&](size_t i) { return known.empty() ? 0.0 : double{known[i]}; };
  double sum = 0, spread = 0, leak = 0;
  for (size_t i = 0; i < extent.pixels(); ++i) {
    sum += double{error.relative[i]} + known_at(i);
    leak += known_at(i);
    spread += double{error.spread[i]};
  }
  double least_sum = spread;
  for (const double bias : error.smooth_bias) least_sum += bias;
  RelmseEstimate result;
  result.relmse = std::max({spread, sum, least_sum}) / pixels;
  if (known.empty() || noisy_pixels(error.noise) < kMinNoisyPixels) return result;
  const std::vector<double> doubts = box_sums(
      extent, [&](size_t i) { return double{error.relative[i]} - double{error.spread[i]} + known_at(i); });
  if (doubts.size() < kMinBoxes) return result;
  // Of noise that neighbours share a part is not found.
  const double width = std::hypot(half_width(doubts), leak);
  // The variance alone is known better. A sum of squares in a box may be one of a few independent values.
  std::vector<double> spreads =
      box_sums(extent, [&](size_t i) { return double{error.spread[i]} * std::numbers::sqrt2; });
  const double least = std::max(0.0, spread - half_width(spreads));
  result.low = std::max(sum - width, least) / pixels;
  result.high = std::max({sum + width, least_sum + half_width(error.smooth_bias), spread}) / pixels;
  return result;
}

}  // namespace lightmill::denoise
