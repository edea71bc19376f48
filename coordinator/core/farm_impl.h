#pragma once
// Inside of Farm, shared by farm.cc (clients), farm_workers.cc (workers), farm_merge.cc (commits),
// farm_pilot.cc (the commit of a pilot), farm_checks.cc (spot checks) and farm_storage.cc (a disk that
// fails).
//
// Locks, in this order: a job's layers (Merger::Open), then `mutex`. Nothing that takes long happens under
// `mutex` but the store's small transactions; decoding, folding, resolving and error metrics happen outside.
// A change is made durable first and applied to memory after.
#include <condition_variable>
#include <mutex>
#include <random>

#include "coordinator/merge/decoder_pool.h"
#include "coordinator/core/farm.h"
#include "coordinator/store/job_store.h"
#include "coordinator/merge/merger.h"
#include "coordinator/farm/scheduler.h"
#include "coordinator/store/storage_health.h"

namespace lightmill {

/// Longest time that a call may wait for something to happen.
inline constexpr double kMaxWaitSeconds = 60;

struct Farm::Impl {
  static constexpr size_t kMaxJobs = 100000;
  static constexpr size_t kMaxListedJobs = 1000;
  /// Tiles of a job in memory, of which any number may be pending or leased. Of committed ones the newest are
  /// there to tell a commit that is repeated; spot checks may want any.
  static constexpr size_t kTilesInMemory = 50000;

  Impl(std::unique_ptr<JobStore> store, const Clock& clock, const FarmOptions& options);

  // All of these want `mutex` held.
  Job& job(const JobId& id);  // throws UnknownJob
  /// Loads the end of the curve, if it is not there: of a job that ended before a restart.
  void load_curve(Job& job);
  /// Loads the ledger of a final job.
  void load_ledger(Job& job);
  /// All of a job's tiles, in memory or not. Leases of a job that has ended are void.
  std::vector<TileRecord> ledger(const Job& job) const;
  /// The record with the wall time up to `now`.
  JobRecord record_at(const Job& job, double now) const;
  /// Stores `record` (whose wall time is up to `now`) and makes it the job's; wakes those who wait.
  void update(Job& job, JobRecord record, double now);
  /// The job goes to a state in which nothing is leased: leases are void, the clock stops.
  void end(Job& job, JobState state, const std::string& message, double now);
  void touch(Job& job);
  /// The same where it brings no work: waiting workers sleep on.
  void touch_quietly(Job& job);
  /// A lease ends without a commit; too many failures fail the job.
  void release(Job& job, const LeaseTable::Lease& lease, bool failed, const std::string& reason, double now);
  /// The same, if the worker holds the lease.
  void release(const WorkerId& worker, const LeaseKey& lease, bool failed, const std::string& reason,
               double now);
  /// The store has the commit: memory follows. Other leases of the tile end.
  void apply_commit(Job& job, JobRecord record, const TileRecord& tile, const LeaseKey& lease,
                    double cpu_seconds, double now);
  void release_expired(double now);
  std::optional<LeaseGrant> try_lease(const WorkerId& worker, double now);
  JobStatus status(const Job& job, double now) const;
  std::vector<JobId> complete_jobs(double now) const;

  // These want no lock.
  /// Round and job ends: a point of the curve, the stop rules, the final state.
  void settle(const JobId& id, Merger::Open& layers);
  void settle(const JobId& id);
  void settle_complete();
  /// Looks whether the store, and jobs whose layers could not be read, are mended.
  void look_again();
  /// The job's layers. If they can't be read the job pauses, and what was thrown passes on.
  Merger::Open open_layers(const JobId& id, const RenderSettings& settings);
  /// Adds the wall time up to `now`; it runs on with the next lease. Wants `mutex` held.
  static void stop_clock(Job& job, double now);
  /// Throws StoreError while the store is at fault.
  void require_storage() const;
  /// Appends a point with estimated and true errors; `layers` is open.
  static void evaluate(Merger::Open& layers, ErrorPoint* point);
  CommitResult refuse(const WorkerId& worker, const LeaseKey& lease, const std::string& reason,
                      const std::string& bytes);
  /// kAccepted while the worker holds the lease; otherwise what its commit would be answered.
  CommitResult standing(const WorkerId& worker, const LeaseKey& lease);
  /// Lets a pinned lease expire again, unless it was committed or released meanwhile.
  struct Unpin {
    Impl& farm;
    const WorkerId& worker;
    const LeaseKey& lease;
    ~Unpin();
  };
  /// The pilot's lease is pinned.
  CommitResult commit_pilot(const WorkerId& worker, const LeaseKey& lease, const std::string& bytes);
  void log(const std::string& line) const;
  void keep_evidence(const LeaseKey& lease, const WorkerId& worker, const std::string& reason,
                     const std::string& bytes) const;

  // Spot checks (farm_checks.cc). The first six want `mutex` held.
  bool draw_check(const WorkerId& worker);
  LeaseGrant lease_check(Job& job, TileId tile, const WorkerId& worker, double now);
  void end_check(Job& job, const LeaseTable::Lease& lease, double cpu_seconds);
  void release_check(Job& job, const LeaseTable::Lease& lease);
  void convict(const WorkerId& liar, const std::string& what, double now);
  /// Checks at the end of a job that nobody is there to do, for a while, are given up.
  void drop_lonely_checks(double now);
  CommitResult commit_check(const WorkerId& worker, const LeaseKey& lease, const Partial& partial,
                            const std::string& digest, const std::string& bytes);
  /// Takes what liars handed in out of the films.
  void take_back_lies();
  void take_back_lies(const JobId& id, Merger::Open& layers);

  const Clock& clock;
  StorageHealth health;
  std::unique_ptr<JobStore> store;
  FarmOptions options;
  mutable std::mutex mutex;
  mutable std::condition_variable changed;  // a job's version: for those who watch
  std::condition_variable work;             // something to lease may have come up: for workers that wait
  bool stopping = false;
  std::optional<std::string> logged_fault;
  uint64_t version = 0;
  std::mt19937_64 random{options.spot_check_seed ? options.spot_check_seed : std::random_device{}()};
  FarmStats stats;
  Scheduler scheduler;
  Merger merger;
  DecoderPool decoders{options.decode_memory_bytes};
};

/// "job j7 tile 3", "job j7 pilot".
std::string tile_name(const LeaseKey& key, bool pilot);

/// What a leased tile of the store is once its leases are void.
TileRecord voided(TileRecord tile);
/// For clients: of a committed tile the lease that counted, else the last one.
TileStatus tile_status(const TileRecord& tile);

/// "j7", "w12".
std::string numbered(std::string prefix, int64_t number);

/// Throws Error(kFailed) with the reason if a decoded partial is not what the lease asked for.
void check_partial(const Partial& partial, const TileSpec& tile, const RenderSettings& settings,
                   const std::optional<int>& quantum_exponent);

}  // namespace lightmill
