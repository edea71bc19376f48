#pragma once
// Which jobs are rendered at the same time, where not all of their films fit into memory: else every commit
// would read another film from the disk. A job keeps its seat for a while, then one that has had less takes
// its turn. Pure.
#include <map>
#include <optional>
#include <vector>

#include "common/base/ids.h"

namespace lightmill {

class FilmAdmission {
 public:
  /// How long a job keeps its seat before others of its priority may have it.
  static constexpr double kTurnSeconds = 10;

  /// What decides who yields: a job of lower priority at once, an equal one after its turn if it has had
  /// more.
  struct Claim {
    int priority = 0;
    double submitter_served = 0, served = 0;  // processor seconds (fair_share.h)
    double bytes = 0;                         // film_bytes()
  };

  explicit FilmAdmission(double max_bytes) : max_bytes_(max_bytes) {}

  /// True if the job is seated, or there is room, or enough others have to yield. One that is larger than
  /// everything may be seated alone.
  bool may_take(const JobId& job, const Claim& claim, double now) const;
  /// Seats a job that may be seated; others yield.
  void take(const JobId& job, const Claim& claim, double now);
  /// A seated job's claim, as it is now.
  void update(const JobId& job, const Claim& claim);
  void leave(const JobId& job);
  bool admitted(const JobId& job) const { return admission_.contains(job); }

 private:
  struct Admission {
    Claim claim;
    double since = 0;
  };
  /// Those that yield, or nothing if that is not enough.
  std::optional<std::vector<JobId>> yielding(const Claim& claim, double now) const;

  const double max_bytes_;
  double bytes_ = 0;
  std::map<JobId, Admission> admission_;
};

}  // namespace lightmill
