#include "common/error/error_fit.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/statistics/student_t.h"
#include "common/error/confidence.h"

namespace lightmill {

namespace {

/// Below this the correlation of neighbouring points is so near to 1 that they are one point.
constexpr double kLeastGrowth = 1.001;

}  // namespace

std::optional<double> relative_deviation(const ErrorPoint& point) {
  if (!point.relmse || !point.relmse_high || point.batches < 2 || !(*point.relmse > 0)) return std::nullopt;
  // Of the interval's parts (error_estimate.cc) this is the one with the smaller quantile: never too little.
  const double quantile = student_t_975(point.batches * (point.batches - 1) / 2);
  return (*point.relmse_high - *point.relmse) / (quantile * *point.relmse);
}

std::optional<ErrorFit> fit_error(const ErrorCurve& curve, bool of_truth) {
  // With correlations N/M the noise of a point, given the one before it, does not depend on earlier ones:
  // y_k - phi y_{k-1} are independent, phi = N_{k-1}/N_k sigma_k/sigma_{k-1}.
  double s_ww = 0, s_wx = 0, s_xx = 0, s_wy = 0, s_xy = 0;
  double last_w = 0, last_x = 0, last_y = 0, last_n = 0, last_sigma = 0, first_x = 0;
  int points = 0;
  for (const ErrorPoint& p : curve.points) {
    const std::optional<double> deviation = relative_deviation(p);
    const std::optional<double>& value = of_truth ? p.true_relmse : p.relmse;
    if (!deviation || !value || !(*value > 0) || !(p.wall_seconds > 0)) continue;
    if (points > 0 && p.spp < last_n * kLeastGrowth) continue;
    const double sigma = std::max(*deviation, 1e-6), x = std::log(p.wall_seconds), y = std::log(*value);
    const double correlation = points > 0 ? last_n / p.spp : 0;
    const double phi = points > 0 ? correlation * sigma / last_sigma : 0;
    const double weight = 1 / (sigma * sigma * (1 - correlation * correlation));
    const double dw = 1 - phi * last_w, dx = x - phi * last_x, dy = y - phi * last_y;
    s_ww += weight * dw * dw;
    s_wx += weight * dw * dx;
    s_xx += weight * dx * dx;
    s_wy += weight * dw * dy;
    s_xy += weight * dx * dy;
    if (points == 0) first_x = x;
    last_w = 1;
    last_x = x;
    last_y = y;
    last_n = p.spp;
    last_sigma = sigma;
    ++points;
  }
  const double determinant = s_ww * s_xx - s_wx * s_wx;
  if (points < 3 || !(last_x > first_x) || !(determinant > 0)) return std::nullopt;
  ErrorFit fit;
  fit.points = points;
  fit.slope = (s_ww * s_xy - s_wx * s_wy) / determinant;
  fit.intercept = (s_xx * s_wy - s_wx * s_xy) / determinant;
  const double half = kNormal975 * std::sqrt(s_ww / determinant);
  fit.slope_low = fit.slope - half;
  fit.slope_high = fit.slope + half;
  return fit;
}

std::optional<Flattening> flattening(const ErrorCurve& curve) {
  if (curve.points.empty()) return std::nullopt;
  const ErrorPoint& last = curve.points.back();
  if (!last.true_relmse || !last.relmse || !last.relmse_high || *last.true_relmse <= *last.relmse_high) {
    return std::nullopt;
  }
  return Flattening{*last.true_relmse, *last.relmse_high, *last.true_relmse - *last.relmse};
}

double Outlook::seconds(double times_less, double speedup) const {
  return spp * (times_less - 1) * seconds_per_spp / speedup;
}

std::optional<Outlook> outlook(const ErrorCurve& curve) {
  if (curve.points.empty()) return std::nullopt;
  const ErrorPoint& last = curve.points.back();
  if (!last.relmse || !(last.wall_seconds > 0) || !(last.spp > 0)) return std::nullopt;
  // The beginning of a job is slower: small tiles, workers that are still loading the scene.
  ErrorPoint from;
  for (const ErrorPoint& p : curve.points) {
    if (p.spp <= last.spp / 2 && p.wall_seconds < last.wall_seconds) from = p;
  }
  return Outlook{*last.relmse, (last.wall_seconds - from.wall_seconds) / (last.spp - from.spp), last.spp};
}

}  // namespace lightmill
