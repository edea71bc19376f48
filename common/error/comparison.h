#pragma once
// Compares several runs of one picture: what each gets out of its time.
#include <optional>
#include <string>
#include <vector>

#include "common/error/error_curve.h"

namespace lightmill {

/// A run's efficiency, 1 / (relMSE x seconds), at its last point with an error.
struct Efficiency {
  std::string name;
  ErrorPoint point;
  bool of_truth =
      false;  // true: from the error against the reference, if every run has it; else from estimates
  double per_cpu_second = 0, per_wall_second = 0;
  /// per_cpu_second over that of the best run, with its 95 % interval where both errors have one. The runs
  /// must be independent (other seeds, or other settings).
  double relative = 0;
  std::optional<double> relative_low, relative_high;
};

/// In the order of `runs`. Runs without any error, or that took no measurable time, are left out.
std::vector<Efficiency> efficiencies(const std::vector<ErrorCurve>& runs);

/// Writes error.csv (as a report's, with the run's name before it), error.svg and report.html into `folder`,
/// made if absent. Runs are known by `job_name`. Throws Error(kFailed) if that fails.
void write_comparison(const std::string& folder, const std::vector<ErrorCurve>& runs);

}  // namespace lightmill
