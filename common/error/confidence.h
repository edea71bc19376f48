#pragma once
// The width of confidence intervals.

namespace lightmill {

/// The 97.5 % quantile of the standard normal distribution: a mean lies within this many standard deviations
/// of what is estimated with 95 % confidence.
inline constexpr double kNormal975 = 1.959963985;

}  // namespace lightmill
