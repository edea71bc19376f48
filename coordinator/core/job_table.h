#pragma once
// The farm's jobs with their ledgers: finds them, loads what memory lacks, and writes a job's row before it
// changes the job. Rows of single tiles are written by Leases and by those who commit.
//
// All methods want FarmState::mutex held, but the constructor.
#include <string>
#include <vector>

#include "coordinator/core/farm_state.h"

namespace lightmill {

class JobTable {
 public:
  /// Reads all jobs of the store, before other threads come.
  explicit JobTable(FarmState& farm);

  /// Throws UnknownJob.
  Job& get(const JobId& id);
  /// Throws UnknownSequence.
  Sequence& get(const SequenceId& id);
  /// Loads the ends of the curves of a sequence's frames that ended before a restart, at most so many. False:
  /// there are more.
  bool load_curves(const Sequence& sequence, size_t most);
  /// Loads the ledger of a final job, if it is not there.
  void load_ledger(Job& job);
  /// All of a job's tiles, in memory or not. Leases of a job that has ended are void.
  std::vector<TileRecord> ledger(const Job& job) const;
  /// Keeps the tiles in memory to a bound; those that go are committed.
  void forget_old_tiles(Job& job) const;
  /// The record with the wall time up to `now`.
  static JobRecord record_at(const Job& job, double now);
  /// Stores `record` (whose wall time is up to `now`) and makes it the job's; wakes those who wait.
  void update(Job& job, JobRecord record, double now);
  /// The job goes to a state in which nothing is leased: leases are void, the clock stops.
  void end(Job& job, JobState state, const std::string& message, double now);
  /// The same for many, each written in one transaction with the others.
  struct Change {
    Job* job;
    JobRecord record;
  };
  void update_all(std::vector<Change> changes, double now);
  void end_all(const std::vector<Job*>& jobs, JobState state, const std::string& message, double now);
  /// Adds the wall time up to `now`; it runs on with the next lease.
  static void stop_clock(Job& job, double now);

 private:
  /// Priority, pool and the like of a frame are those of its sequence. Throws StoreError if there is none.
  void take_from_sequence(JobRecord* frame) const;
  /// Loads the end of the curve, if it is not there: of a job that ended before a restart.
  void load_curve(Job& job);
  /// Of a job that is about to end: hooks are to be told. Of a frame: once its sequence has ended.
  void count_end(JobRecord* record);
  // What the store has:
  void become(Job& job, JobRecord record, double now);
  void become_ended(Job& job, JobRecord record);
  /// The workers of these leases hold one less.
  void forget_leases(const Job& job, const std::vector<LeaseTable::Lease>& leases);

  FarmState& farm_;
};

}  // namespace lightmill
