#pragma once
// The denominators of relMSE, 1 / (R^2 + e), where R is only estimated (derivation: error_weights.cc).
#include <algorithm>
#include <span>
#include <vector>

#include "common/error/batch_moments.h"

namespace lightmill {

inline constexpr double kRelMseEpsilon = 1e-2;

/// A positive number as a fraction: code that needs several of them divides once.
struct Fraction {
  double numerator, denominator;
};

/// 1 / (R^2 + e) from a mean of R with variance t, without the bias of first order in t. `stretch`: 1 + 2/n
/// if the mean is that of the other batches than the one that is weighted, else 1. At most 1/e.
inline Fraction corrected_weight(double mean, double t, double stretch) {
  // With D = mean^2 + e and z = y / D^2: D / (D^2 + y) or (D^2 - y) / D^3.
  const double m2 = mean * mean;
  const double d = m2 + kRelMseEpsilon;
  const double y = stretch * t * (3 * m2 - kRelMseEpsilon);
  const double numerator = y >= 0 ? d : d * d - y;
  const double denominator = y >= 0 ? d * d + y : d * d * d;
  return {numerator, std::max(denominator, kRelMseEpsilon * numerator)};
}

/// R^2 and the noise according to the pixels around, per value (pixels x channels).
struct Neighbourhood {
  std::vector<float> square;  // mean of R^2 around
  std::vector<float> noise;   // mean variance of the batches' mean around
};

/// From the batches' mean image and the variance of that mean. Both have 3 width rows values, and so has
/// `around` then.
void neighbourhood(std::span<const float> mean, std::span<const float> variance, const PixelLayout& layout,
                   const PixelReach& reach, Neighbourhood* around);

/// A value's own weight and the one that the mean of R^2 around gives: the more of the latter, the larger
/// the noise is.
inline double blend_with_around(const Fraction& own, double noise, double square) {
  // 1 / (share known + (1 - share) / own), share = x^2 / ((x + 0.3) (x + 0.03)) with x = noise / known.
  const double known = square + kRelMseEpsilon;
  const double part = noise * noise, whole = (noise + 0.3 * known) * (noise + 0.03 * known);
  return whole * own.numerator / (part * known * own.numerator + (whole - part) * own.denominator);
}

/// The weight of a value: its own where it is known better than the pixels around it, else theirs.
inline double blended_weight(double mean, double t, double stretch, double square, double noise) {
  return blend_with_around(corrected_weight(mean, t, stretch), std::max(t, noise), square);
}

}  // namespace lightmill
