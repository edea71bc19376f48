#pragma once
// Who has had how much of the workers' time, among jobs of equal priority: first by submitter, then by job.
// Pure.
//
// Time is processor seconds: a lease is charged with what its tile is expected to take, and corrected to what
// it took when it ends. Whoever has had least comes next. A job begins level with the one that has had least
// of those that compete then, so that it gets its share from now on: neither all the time that others had
// before it came, nor a place behind them. A restart of the coordinator makes all level.
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "coordinator/farm/job_record.h"

namespace lightmill {

/// A job's side of it.
struct JobShare {
  bool competes = false;
  double served = 0;                                     // processor seconds, on a scale of its submitter's
  std::map<std::pair<TileId, int64_t>, double> charges;  // of leases under way, by tile and attempt
  const double* submitters = nullptr;                    // submitter_served, while it competes
};

class FairShare {
 public:
  /// The job wants workers from now on, or wants none for a while.
  void join(const JobRecord& job, JobShare* share);
  void leave(const JobRecord& job, JobShare* share);
  /// What the job's submitter has had, on a scale of the job's priority. Of jobs that compete the one with
  /// the lesser pair (submitter's, its own `served`) comes first.
  double submitter_served(const JobRecord& job) const;
  /// A lease was granted that will take about so long.
  void charge(const JobRecord& job, JobShare* share, TileId tile, int64_t attempt, double seconds);
  /// It ended, and took so long; 0 if it came to nothing. Once per charge; without one nothing happens.
  void settle(const JobRecord& job, JobShare* share, TileId tile, int64_t attempt, double seconds);
  /// All leases of the job ended and came to nothing.
  void settle_all(const JobRecord& job, JobShare* share);

 private:
  static constexpr size_t kMaxIdle = 4096;  // submitters without jobs that are remembered
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
