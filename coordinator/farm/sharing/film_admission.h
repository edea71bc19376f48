#pragma once
// Admits jobs for rendering at the same time as far as their films fit into memory. Else every commit would
// read another film from the disk. An admitted job stays for a while, then one that has had less takes its
// turn. Pure.
#include <map>
#include <optional>
#include <vector>

#include "common/base/ids.h"

namespace lightmill {

class FilmAdmission {
 public:
  /// How long a job stays admitted before others of its priority may replace it.
  static constexpr double kTurnSeconds = 10;

  /// What decides who yields: a job of lower priority at once, one of equal priority after its turn if it has
  /// had more.
  struct Claim {
    int priority = 0;
    double submitter_served = 0, served = 0;  // processor seconds (fair_share.h)
    double bytes = 0;                         // film_bytes()
  };

  explicit FilmAdmission(double max_bytes) : max_bytes_(max_bytes) {}

  /// True if the job is admitted, or there is room, or enough others have to yield. A job that is larger than
  /// all of the memory may be admitted alone.
  bool may_take(const JobId& job, const Claim& claim, double now) const;
  /// Admits a job for which may_take() is true. Others yield.
  void take(const JobId& job, const Claim& claim, double now);
  /// Replaces an admitted job's claim by the present one.
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
