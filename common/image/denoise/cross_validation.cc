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
// E[f b] > 0 the estimate is too low. Stein's identity says by how much: E[f b] = sum over pixels of
// df / db times a covariance of b. A probe measures that sum (Ramani et al., "Monte-Carlo SURE", 2008): noise
// n with b's covariance, but independent of it, is added to B, and n times the change of F_A has that mean.
// The difference of the halves has twice b's covariance, whatever correlation neighbours have. It is made
// independent of a and b in place: moved by half a box, brought to the level of noise there, and turned in
// sign at random box by box. By symmetry E[g a] is the same as E[f b].
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
#include <cstdint>

#include "common/base/split_mix.h"
#include "common/base/statistics/student_t.h"
#include "common/image/denoise/blend.h"

namespace lightmill::denoise {

namespace {

constexpr int kBoxSide = 16;
constexpr size_t kMinBoxes = 16;
constexpr int kProbeSide = 32;    // of the boxes in which noise is moved, whole but for four seams
constexpr int kLevelRadius = 3;   // of the boxes over which the level of noise is a mean
constexpr float kMostScale = 16;  // of noise that is moved to where there is more
constexpr float kProbe = 0.5f;    // of the noise that a half has: more would change what the filter does
constexpr uint64_t kSignSeed = 0x64656e6f697365;

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

/// A pixel half a box away, in the same box.
int opposite(int x, int pixels) {
  const int begin = x / kProbeSide * kProbeSide, side = std::min(kProbeSide, pixels - begin);
  return begin + (x - begin + side / 2) % side;
}

/// Half-width of the 95 % interval of the sum of such sums.
double half_width(const std::vector<double>& sums) {
  double squares = 0, fourths = 0;
  for (const double s : sums) squares += s * s, fourths += s * s * s * s;
  if (!(fourths > 0)) return 0;
  // The variance's variance is 2 sum sigma^4 for normal sums, and their fourth moments are 3 sigma^4.
  const double freedom = std::clamp(3 * squares * squares / fourths, 1.0, 1e6);
  return student_t_975(static_cast<int>(freedom)) * std::sqrt(squares);
}

}  // namespace

ErrorPlanes estimate_error(const Extent& extent, const Halves& halves, const Halves& filtered, int threads) {
  ErrorPlanes error{Plane(extent.pixels()), Plane(extent.pixels()), Plane(extent.pixels())};
  for_rows(extent, threads, [&](int y) {
    const size_t begin = extent.at(0, y), end = begin + static_cast<size_t>(extent.width);
    for (int c = 0; c < 3; ++c) {
      const Plane &fa = filtered.of[0].c[c], &fb = filtered.of[1].c[c];
      const Plane &a = halves.of[0].c[c], &b = halves.of[1].c[c];
      for (size_t i = begin; i < end; ++i) {
        const float half = 0.5f * (fa[i] - fb[i]), spread = half * half * (1.0f / 3);
        const float squared = spread + (a[i] - fa[i]) * (b[i] - fb[i]) * (1.0f / 3);
        const float weight = weight_of(fa[i], fb[i]);
        error.squared[i] += squared;
        error.relative[i] += squared * weight;
        error.spread[i] += spread * weight;
      }
    }
  });
  return error;
}

Colour noise_like_a_half(const Extent& extent, const Halves& halves, int threads) {
  Colour noise(extent.pixels());
  for (int c = 0; c < 3; ++c) {
    const Plane &a = halves.of[0].c[c], &b = halves.of[1].c[c];
    Plane level(extent.pixels());
    for (size_t i = 0; i < extent.pixels(); ++i) level[i] = (a[i] - b[i]) * (a[i] - b[i]);
    box_mean(extent, kLevelRadius, threads, &level);
    for (int y = 0; y < extent.height; ++y) {
      for (int x = 0; x < extent.width; ++x) {
        const auto box =
            (static_cast<uint64_t>(y / kProbeSide) << 32) + static_cast<uint64_t>(x / kProbeSide);
        const size_t from = extent.at(opposite(x, extent.width), opposite(y, extent.height)),
                     to = extent.at(x, y);
        if (!(level[from] > 0)) continue;
        // Of A - B, whose variance is twice that of B.
        const float size = kProbe * std::sqrt(0.5f * std::min(level[to] / level[from], kMostScale));
        noise.c[c][to] = (split_mix(kSignSeed ^ box) >> 63 ? size : -size) * (a[from] - b[from]);
      }
    }
  }
  return noise;
}

Plane knowledge_of_other(const Extent& extent, const Halves& filtered, const Colour& probed,
                         const Colour& noise, int threads) {
  Plane known(extent.pixels());
  for_rows(extent, threads, [&](int y) {
    const size_t begin = extent.at(0, y), end = begin + static_cast<size_t>(extent.width);
    for (int c = 0; c < 3; ++c) {
      const Plane &fa = filtered.of[0].c[c], &fb = filtered.of[1].c[c];
      for (size_t i = begin; i < end; ++i) {
        known[i] += (probed.c[c][i] - fa[i]) * noise.c[c][i] * weight_of(fa[i], fb[i]) * (2.0f / 3) /
                    (kProbe * kProbe);
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
  RelmseEstimate result;
  result.relmse = std::max(spread, sum) / pixels;
  if (known.empty()) return result;
  const std::vector<double> doubts = box_sums(
      extent, [&](size_t i) { return double{error.relative[i]} - double{error.spread[i]} + known_at(i); });
  if (doubts.size() < kMinBoxes) return result;
  // A probe that finds something finds it to about a factor of two.
  const double width = std::hypot(half_width(doubts), leak);
  // The variance alone is known better. A sum of squares in a box may be one of a few independent values.
  std::vector<double> spreads =
      box_sums(extent, [&](size_t i) { return double{error.spread[i]} * std::numbers::sqrt2; });
  const double least = std::max(0.0, spread - half_width(spreads));
  result.low = std::max(sum - width, least) / pixels;
  result.high = std::max(sum + width, spread) / pixels;
  return result;
}

}  // namespace lightmill::denoise
