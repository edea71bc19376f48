#pragma once
// One job in depth, for one browser: what changed of its settings, curve and tiles since the last time.
#include <map>
#include <optional>
#include <string>
#include <tuple>

#include "coordinator/core/farm.h"

namespace lightmill {

class JobFollower {
 public:
  JobFollower(const Farm& farm, JobId job) : farm_(farm), job_(std::move(job)) {}
  /// A "job" event with {"id", "full"} and, where they changed, "detail", "points" (from number
  /// "points_from" on), "tiles" and "first_tile" (those below have been left behind); of a frame of a
  /// sequence "row", too. Empty if nothing changed. A job that is not there is {"id", "missing": true}, once.
  std::string next();

 private:
  const Farm& farm_;
  const JobId job_;
  bool begun_ = false, missing_ = false;
  uint64_t version_ = 0;
  std::string detail_;
  std::tuple<double, double, JobState> curve_mark_{};  // relMSE, spp and state when the curve was last read
  std::optional<double> denoised_mark_;                // the denoised image's error at that time
  size_t points_ = 0;
  std::map<int64_t, std::string> tiles_;  // as they were sent, but for ages
};

}  // namespace lightmill
