#pragma once
// Spot checks: one in so many committed tiles is rendered once more by another worker.
//
// A tile is folded when it is committed, checked or not. To hold it back would hold back the picture. It
// would not help either: a worker that is caught has handed in other tiles before that nobody looked at.
// Instead the partials of a job stay in the store until its end, also those that a snapshot contains. So all
// that a liar handed in can be taken out of the film, which is folded anew from the rest. A job ends after
// its checks.
//
// Who is right is decided in coordinator/farm/check_table.h; a check's lease is kept by Leases.
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/leases.h"
#include "coordinator/core/repair/storage_guard.h"
#include "coordinator/core/round_ends.h"

namespace lightmill {

class SpotChecks {
 public:
  SpotChecks(FarmState& farm, JobTable& jobs, StorageGuard& storage, Leases& leases, RoundEnds& ends);

  // --- FarmState::mutex held ---
  /// Whether the tile that this worker commits now is to be checked.
  bool draw(const WorkerId& worker);
  /// Checks at the end of a job that nobody is there to do, for a while, are given up.
  void drop_lonely(double now);

  // --- FarmState::mutex not held, nor any layers ---
  /// Takes what the worker rendered under a check's lease, which is pinned.
  CommitResult commit(const WorkerId& worker, const LeaseKey& lease, const Partial& partial,
                      const std::string& digest, const std::string& bytes);
  /// Takes what liars handed in out of the films.
  void take_back_lies();

 private:
  /// The tiles of a job that have to go, and what the job is without them.
  struct Retraction {
    std::vector<TileRecord> tiles;  // as they are now: committed
    JobRecord record;
  };

  // FarmState::mutex held:
  /// Counts the vote and does what follows. The difference to what was committed, one line; empty if there is
  /// none.
  std::string vote(Job& job, const WorkerId& worker, const LeaseKey& lease, const Partial& partial,
                   const std::string& digest);
  void pass(Job& job, TileId tile, double now);
  void credit(const WorkerId& worker, const Partial& partial, double now);
  void convict(const WorkerId& liar, const std::string& what, double now);
  void give_up(Job& job, double now);
  void release_leases_of_liars(Job& job, double now);
  Retraction retraction(const Job& job, double now) const;
  /// Makes the tiles pending again, in store and memory.
  void retract(Job& job, Retraction retraction, Merger::Open& layers);

  /// `layers`: the job's. FarmState::mutex not held.
  void take_back_lies(const JobId& id, Merger::Open& layers);

  FarmState& farm_;
  JobTable& jobs_;
  StorageGuard& storage_;
  Leases& leases_;
  RoundEnds& ends_;
  std::mt19937_64 random_;  // guarded by FarmState::mutex
};

}  // namespace lightmill
