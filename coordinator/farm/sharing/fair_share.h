#pragma once
// Fair shares: how much of the workers' time each job of equal priority has had, first by submitter, then by
// job. The frames of a sequence have one share together. Pure.
//
// Time is processor seconds. A lease is charged with what its tile is expected to take, and corrected when it
// ends. The job that has had least comes next. A new job begins level with the one that has had least of
// those that compete then. So it gets its share from now on: neither all the time that others had before it
// came, nor a place behind them. A restart of the coordinator makes all level.
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "coordinator/farm/job_record.h"

namespace lightmill {

/// The share of one job, or of one sequence.
struct JobShare {
  bool competes = false;
  double served = 0;                   // processor seconds, on its submitter's scale
  std::map<LeaseKey, double> charges;  // of present leases
  const double* submitters = nullptr;  // submitter_served, while it competes
};

class FairShare {
 public:
  /// The job wants workers from now on; or wants none for a while.
  void join(const JobRecord& job, JobShare* share);
  void leave(const JobRecord& job, JobShare* share);
  /// What jobs of equal priority are ordered by: (submitter_served, share.served), of a job that does not
  /// compete as join() would make them.
  std::pair<double, double> standing(const JobRecord& job, const JobShare& share) const;
  /// What the job's submitter has had, on the scale of the job's priority. Of the jobs that compete, the one
  /// with the lesser pair (submitter's, its own `served`) comes first.
  double submitter_served(const JobRecord& job) const;
  /// Charges a lease that was granted and is expected to take `seconds`.
  void charge(const JobRecord& job, JobShare* share, TileId tile, int64_t attempt, double seconds);
  /// Settles it after it ended and took `seconds`; 0 if it had no result. Once per charge; does nothing
  /// without one.
  void settle(const JobRecord& job, JobShare* share, TileId tile, int64_t attempt, double seconds);
  /// Settles all leases of this job, without a result.
  void settle_all(const JobRecord& job, JobShare* share);

 private:
  static constexpr size_t kMaxIdle = 4096;  // most submitters without jobs that are remembered
  struct Account {
    double served = 0;
    std::set<const JobShare*> competing;
  };
  using Level = std::map<std::string, Account>;  // by submitter
  Account& account(const JobRecord& job);
  void forget_idle(Level* level);

  std::map<int, Level> levels_;  // by priority
};

}  // namespace lightmill
