#pragma once
// The denominators of relMSE, 1 / (R^2 + e), where R itself is only estimated (derivation: error_weights.cc).
#include <algorithm>
#include <span>
#include <vector>

#include "common/image/error_estimate.h"

namespace lightmill {

inline constexpr double kRelMseEpsilon = 1e-2;

/// 1 / (R^2 + e) from a mean of R with variance t, without the bias of first order in t; `stretch` is 1 + 2/n
/// where the mean is that of the batches beside the one that is weighted, else 1. At most 1/e.
inline double corrected_weight(double mean, double t, double stretch) {
  // With D = mean^2 + e and z = y / D^2: D / (D^2 + y) or (D^2 - y) / D^3, so that one division does.
  const double m2 = mean * mean;
  const double d = m2 + kRelMseEpsilon;
  const double y = stretch * t * (3 * m2 - kRelMseEpsilon);
  const double numerator = y >= 0 ? d : d * d - y;
  const double denominator = y >= 0 ? d * d + y : d * d * d;
  return std::min(1 / kRelMseEpsilon, numerator / denominator);
}

/// What the pixels around say of R^2 and of the noise, per value (pixels x channels).
struct Neighbourhood {
  std::vector<float> square;  // mean of R^2 around
  std::vector<float> noise;   // mean variance of the batches' mean around
};

/// From the batches' mean image and the variance of that mean; both have 3 width rows values.
Neighbourhood neighbourhood(std::span<const float> mean, std::span<const float> variance,
                            const PixelLayout& layout, const PixelReach& reach);

/// The weight of a value: its own where it is known better than the pixels around it, theirs where not.
inline double blended_weight(double mean, double t, double stretch, double square, double noise) {
  const double known = square + kRelMseEpsilon;
  const double x = std::max(t, noise) / known;
  const double share = x * x / ((x + 0.3) * (x + 0.03));
  const double own = 1 / corrected_weight(mean, t, stretch);
  return 1 / (share * known + (1 - share) * own);
}

}  // namespace lightmill
