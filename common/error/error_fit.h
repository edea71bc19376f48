#pragma once
// What a curve of error against time says: its slope, whether it flattens, and what more time buys.
#include <optional>
#include <string>

#include "common/error/error_curve.h"

namespace lightmill {

/// log(relMSE) = intercept + slope log(wall seconds), over the points that have an interval, and the slope's
/// own 95 % interval. Independent samples at a steady pace have a slope of -1.
struct ErrorFit {
  double slope = 0, slope_low = 0, slope_high = 0;
  double intercept = 0;
  int points = 0;
};

/// Generalised least squares. The errors of a curve's points are not independent, as later points hold the
/// samples of earlier ones. The fit assumes that the deviation of |mean of N samples - R|^2 from its
/// expectation has the correlation N/M with that of M > N samples (exact for normal noise). `of_truth`: fits
/// the errors against the reference in place of the estimates. Empty below three points, or if all are at one
/// time.
std::optional<ErrorFit> fit_error(const ErrorCurve& curve, bool of_truth);

/// The part of the true error that noise does not explain: the true error of the last point lies above the 95
/// % interval of the estimate, which knows of noise alone. A bias, or noise in the reference, does not fall
/// with more samples. (Chance alone does this once in 40.)
struct Flattening {
  double true_relmse = 0;
  double noise_high = 0;  // upper end of what noise explains
  double floor = 0;       // true error minus estimate: about what infinitely many samples would leave
};
std::optional<Flattening> flattening(const ErrorCurve& curve);

/// What more samples bring: relMSE ~ 1/samples, samples ~ worker time, at the pace of the curve's second
/// half.
struct Outlook {
  double relmse = 0;           // of the last estimate
  double seconds_per_spp = 0;  // wall time
  double spp = 0;
  /// Wall seconds from here until the error is 1/`times_less` of the present one, with `speedup` times the
  /// present workers.
  double seconds(double times_less, double speedup) const;
};
std::optional<Outlook> outlook(const ErrorCurve& curve);

/// Relative standard deviation of a point's error, from its interval; empty without one.
std::optional<double> relative_deviation(const ErrorPoint& point);

}  // namespace lightmill
