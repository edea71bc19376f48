#pragma once
// Error against run time: the curve of a job.
//
// relMSE = mean((I-R)^2 / (R^2 + 1e-2)) over pixels and channels. How it is estimated says README.md.
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lightmill {

/// Sides of the boxes of pixels whose means have errors of their own.
inline constexpr std::array<int, 3> kBoxSides{4, 16, 32};

/// relMSE of the means over boxes of pixels, times the pixels of a box: noise of independent pixels has the
/// same at every size. The boxes are those that lie wholly in the image, side by side from its upper left
/// corner on. Empty where none does, and else as in ErrorPoint; fewer than 16 boxes have no interval.
struct BoxError {
  std::optional<double> relmse, relmse_low, relmse_high, true_relmse;
  bool operator==(const BoxError&) const = default;
};

using BoxErrors = std::array<BoxError, kBoxSides.size()>;

struct ErrorPoint {
  double wall_seconds = 0;
  double cpu_seconds = 0;
  double spp = 0;
  std::optional<double> relmse;                   // estimated
  std::optional<double> relmse_low, relmse_high;  // its 95 % interval, from 4 batches on
  int batches = 0;
  // Only with a reference image:
  std::optional<double> true_relmse, true_relmse_trimmed, true_flip;
  BoxErrors boxes = {};
  /// Of the image denoised, with its 95 % interval (common/image/denoise/): of some points, of jobs that ask.
  std::optional<double> denoised_relmse = {}, denoised_relmse_low = {}, denoised_relmse_high = {};
};

/// The rule of --target-error: the upper end of the interval is below the target (0: none); `denoised`: that
/// of the denoised image. Applied at checkpoints (checkpoints.h) only.
inline bool meets_target(const ErrorPoint& point, double target, bool denoised = false) {
  const std::optional<double>& high = denoised ? point.denoised_relmse_high : point.relmse_high;
  return target > 0 && high && *high < target;
}

struct ErrorCurve {
  std::string job_name;
  std::vector<ErrorPoint> points;
};

/// A point is stored again once its image was denoised: of those of equal spp the last one stays, where the
/// first one was.
std::vector<ErrorPoint> newest_points(std::vector<ErrorPoint> stored);

/// JSON, the form that is stored and sent. curve_from_json throws Error(kFailed).
std::string curve_to_json(const ErrorCurve& curve);
ErrorCurve curve_from_json(const std::string& text);

}  // namespace lightmill
