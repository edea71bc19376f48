#pragma once
// A job in memory: its row, its tiles and what else the scheduler goes by.
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "common/error/error_curve.h"
#include "coordinator/farm/check_table.h"
#include "coordinator/farm/job_record.h"
#include "coordinator/farm/lease_table.h"
#include "coordinator/farm/sharing/fair_share.h"
#include "coordinator/farm/worker_table.h"

namespace lightmill {

/// What the end of a job with very many workers is planned by, counted now and then (job_tail.h).
struct TailCounts {
  double counted_at = -1;  // clock time; negative: not yet
  int64_t idle = 0;
  double seconds_to_end = -1;   // negative: unknown
  int64_t sharers = 1;          // workers that the rest is shared by
  double look_for_race_at = 0;  // not before this clock time
};

/// (clock time, pixel samples) of the newest commits, oldest first (job_progress.h).
using RecentSamples = std::deque<std::pair<double, double>>;

/// Whether a job or a sequence will be done in time, looked at now and then (sharing/deadlines.h).
struct Punctuality {
  double looked_at = -1;    // clock time; negative: not yet
  bool late = false;        // or nobody knows
  double seconds_late = 0;  // by its rate; 0 if it is in time, or that is not known
};

/// A job as the scheduler sees it.
struct Job {
  JobRecord record;
  LeaseTable tiles;  // of a final job only while `ledger_loaded`
  bool ledger_loaded = true;
  bool curve_loaded = true;   // last_point and last_estimate
  double running_since = -1;  // clock time up to which wall_seconds is summed; negative: does not run
  int64_t batch_group = 1;    // BatchFilm::max_tile_superblocks() of its layers
  std::set<std::pair<TileId, WorkerId>> failed_on;  // do not give it to the same worker again if others can
  std::map<WorkerId, FailureKind> unable;   // who reported that it can't render the job at all, and why
  std::map<WorkerId, int> memory_faults;    // tiles for which it had not enough memory
  std::map<TileId, int> silent_ends;        // leases of a tile whose workers were never heard of again
  std::map<TileId, int> overdue;            // leases of a tile that lasted for too long
  uint64_t least_memory = 0;                // bytes with which proven workers ran out of memory
  int failures_in_row = 0;                  // failed tiles without a commit in between
  std::optional<ErrorPoint> last_point;     // of the curve
  std::optional<ErrorPoint> last_estimate;  // last one with a relMSE
  std::optional<ErrorPoint> last_denoised;  // last one with the error of the denoised image
  double denoised_spp = 0;                  // up to which that error was looked at, or could not be
  bool denoising = false;                   // it is being estimated
  RecentSamples recent;
  mutable Punctuality punctuality;
  double commit_bytes = 0,
         commit_pixels = 0;  // of partials since the start: bytes, and pixels of their tiles
  uint64_t version = 0;
  std::string fault;          // why its layers can't be read; empty if they can, or nobody tried
  double look_at = 0;         // clock time to try again
  bool needs_repair = false;  // they were found damaged twice, a while apart
  int repairs = 0;            // since the start
  std::string missing_file;   // of its scene, for people; empty: all are there, as far as is known
  bool lacks_file = false;    // a worker could not get it: nothing is leased until it is back
  JobShare share;
  CheckTable checks;         // of a final job only while `ledger_loaded`
  std::set<WorkerId> liars;  // whose tiles are to be taken back
  mutable TailCounts tail;   // of so many workers that counting them for each lease would take too long
  double lonely_since = -1;  // clock time since when only checks are left, without anybody to do them
};

/// It has not ended, is not paused, and its layers and files can be read.
inline bool is_runnable(const Job& job) {
  return job.fault.empty() && !job.lacks_file &&
         (job.record.state == JobState::kQueued || job.record.state == JobState::kRunning);
}

/// The last estimate of what its target error is of.
inline const std::optional<ErrorPoint>& target_estimate(const Job& job) {
  return job.record.settings.target_denoised ? job.last_denoised : job.last_estimate;
}
/// The upper end of that error's interval.
inline std::optional<double> target_estimate_high(const Job& job) {
  const std::optional<ErrorPoint>& last = target_estimate(job);
  if (!last) return std::nullopt;
  return job.record.settings.target_denoised ? last->denoised_relmse_high : last->relmse_high;
}

/// The worker may work for the job: its pool and its arithmetic class are the job's, and it has more memory
/// than those that ran out of it. A worker that doesn't say how much it has may have enough.
inline bool fits(const Job& job, const Worker& worker) {
  const JobRecord& record = job.record;
  return (record.pool.empty() || record.pool == worker.registration.pool) &&
         (record.arithmetic_class.empty() ||
          record.arithmetic_class == worker.registration.arithmetic_class) &&
         (job.least_memory == 0 || worker.registration.memory_bytes == 0 ||
          worker.registration.memory_bytes > job.least_memory);
}

}  // namespace lightmill
