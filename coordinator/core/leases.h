#pragma once
// Leases of all jobs' tiles, and of committed tiles that are rendered once more to compare (spot checks):
// who gets one, when it ends, and what its end means for tile, worker and job. The store has every change of
// a tile before memory has it; leases of checks are in memory only.
//
// All methods but standing() want FarmState::mutex held.
#include <optional>
#include <string>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"

namespace lightmill {

class Leases {
 public:
  Leases(FarmState& farm, JobTable& jobs) : farm_(farm), jobs_(jobs) {}

  /// What the scheduler offers the worker; opens rounds and cuts tiles on the way.
  std::optional<LeaseGrant> grant(const WorkerId& worker, double now);
  /// True if the worker holds this lease, of a tile or a check.
  static bool holds(const Job& job, const WorkerId& worker, const LeaseKey& lease);
  /// False if the worker does not hold it any more.
  bool renew(const WorkerId& worker, const LeaseKey& lease, double now);
  /// Lets a lease that was pinned for a commit expire again, unless it has ended meanwhile.
  void unpin(const WorkerId& worker, const LeaseKey& lease);

  /// A lease ends without a commit. Too many failures fail the job.
  void release(Job& job, const LeaseTable::Lease& lease, bool failed, const std::string& reason, double now);
  /// The same, also for a check's, if the worker holds the lease.
  void release(const WorkerId& worker, const LeaseKey& lease, bool failed, const std::string& reason,
               double now);
  /// Ends those whose time is over.
  void release_expired(double now);
  /// Ends those that are renewed and renewed while others could do the work.
  void release_overdue(double now);
  /// Makes sure that the store knows the lease, as a commit under it needs.
  void store_lease(Job& job, const LeaseKey& lease, double now);
  /// The worker has one lease less: a check's has ended, after so much processor time.
  void end_check(Job& job, const LeaseTable::Lease& lease, double cpu_seconds);
  /// The store has the commit: memory follows. Other leases of the tile end.
  void apply_commit(Job& job, JobRecord record, const TileRecord& tile, const LeaseKey& lease,
                    double cpu_seconds, double now);

  /// kAccepted while the worker holds the tile's lease; otherwise what its commit is answered, which is then
  /// counted. Wants FarmState::mutex not held.
  CommitResult standing(const WorkerId& worker, const LeaseKey& lease);

 private:
  void open_round(const RoundOffer& round);
  void split(const SplitOffer& cut);
  LeaseGrant grant_tile(Job& job, TileId tile, const WorkerId& worker, double now);
  LeaseGrant grant_check(Job& job, TileId tile, const WorkerId& worker, double now);
  void log_end(const Job& job, const LeaseTable::Lease& lease, const std::string& how) const;
  void release_check(Job& job, const LeaseTable::Lease& lease);
  /// Fails the job if too many workers never came back from this tile.
  void fail_if_deadly(Job& job, const TileRecord& record, const WorkerId& worker, double now);
  /// Fails the job if its tile, just released as `record`, has failed too often.
  void fail_if_hopeless(Job& job, const TileRecord& record, const WorkerId& worker, bool failed,
                        const std::string& reason, double now);

  FarmState& farm_;
  JobTable& jobs_;
};

}  // namespace lightmill
