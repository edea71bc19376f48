#pragma once
// What all parts of the farm share: the store, the scheduler's tables, and the lock over them.
//
// Locks are taken in this order: a job's layers (Merger::Open), then `mutex`. Nobody opens layers while
// holding `mutex`. Under `mutex` nothing takes long but the store's small transactions: decoding, folding,
// resolving and error metrics happen outside. A change is made durable first and applied to memory after.
//
// The parts state for each method whether the caller holds `mutex`, or must not.
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "common/base/clock.h"
#include "coordinator/core/farm_options.h"
#include "coordinator/core/farm_report.h"
#include "coordinator/core/pilots/first_looks.h"
#include "coordinator/farm/scheduler.h"
#include "coordinator/merge/merger.h"
#include "coordinator/store/job_store.h"
#include "coordinator/store/storage_health.h"

namespace lightmill {

/// Longest time that a call may wait for something to happen.
inline constexpr double kMaxWaitSeconds = 60;

struct FarmState {
  FarmState(std::unique_ptr<JobStore> job_store, const Clock& the_clock, const FarmOptions& farm_options);

  // These need no lock: they are constant, or have locks of their own.
  const Clock& clock;
  StorageHealth health;
  const std::unique_ptr<JobStore> store;  // which tells `health` of its failures
  const FarmOptions options;

  mutable std::mutex mutex;
  // Both wait on `mutex`.
  mutable std::condition_variable changed;  // a job's version: for those who watch
  std::condition_variable work;             // something to lease may have come up: for workers that wait
  // Guarded by `mutex`.
  bool stopping = false;
  uint64_t version = 0;  // of the newest change of a job
  FarmStats stats;
  double undisturbed_since = 0;  // clock time since when the disk has taken commits
  Scheduler scheduler;
  FirstLooks first_looks;

  Merger merger;  // has locks of its own

  // --- `mutex` held ---
  /// The job has changed: wakes those who watch it.
  void touch_quietly(Job& job);
  /// The same where the change may bring work: wakes waiting workers too.
  void touch(Job& job);

  // --- with or without `mutex` ---
  /// Tells the operator.
  void log(const std::string& line) const;
  /// Keeps what a worker sent, to be looked at later. What goes wrong with that is logged.
  void keep_evidence(const LeaseKey& lease, const WorkerId& worker, const std::string& reason,
                     const std::string& bytes) const;
  /// A new id of the store's counter `kind`: "j7", "w12".
  std::string new_id(const char* prefix, const char* kind) const;
};

}  // namespace lightmill
