#pragma once
// The scheduler: which tile for which worker, when to open a round, when a job is complete. Pure: it decides
// on (state, now) and never waits, stores or renders; the farm makes a decision durable and then applies it.
#include <deque>
#include <map>
#include <set>
#include <variant>
#include <vector>

#include "common/error/error_curve.h"
#include "coordinator/farm/check_table.h"
#include "coordinator/farm/fair_share.h"
#include "coordinator/farm/film_admission.h"
#include "coordinator/farm/lease_table.h"
#include "coordinator/farm/tiling.h"
#include "coordinator/farm/worker_table.h"

namespace lightmill {

/// What the end of a job with very many workers is planned by, counted now and then (scheduler_tail.cc).
struct TailCounts {
  double counted_at = -1;  // clock time; negative: not yet
  int64_t idle = 0;
  double seconds_to_end = -1;   // negative: unknown
  int64_t sharers = 1;          // workers that the rest is shared by
  double look_for_race_at = 0;  // not before this clock time
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
  int failures_in_row = 0;                          // failed tiles without a commit in between
  std::optional<ErrorPoint> last_point;             // of the curve
  std::optional<ErrorPoint> last_estimate;          // last one with a relMSE
  std::deque<std::pair<double, double>> recent;     // (clock time, pixel samples) of the newest commits
  double commit_bytes = 0,
         commit_pixels = 0;  // of partials since the start: bytes, and pixels of their tiles
  uint64_t version = 0;
  std::string fault;   // why its layers can't be read; empty if they can, or nobody tried
  double look_at = 0;  // clock time to try again
  JobShare share;
  CheckTable checks;         // of a final job only while `ledger_loaded`
  std::set<WorkerId> liars;  // whose tiles are to be taken back
  mutable TailCounts tail;   // of so many workers that counting them for each lease would take too long
  double lonely_since = -1;  // clock time since when only checks are left, without anybody to do them
};

/// It has not ended, is not paused, and its layers can be read.
inline bool is_runnable(const Job& job) {
  return job.fault.empty() &&
         (job.record.state == JobState::kQueued || job.record.state == JobState::kRunning);
}

struct SchedulerOptions {
  double target_tile_seconds = 1;
  double film_memory_bytes = 0x1p30;
  double ingest_bytes_per_second = 0;  // that all commits together may bring; 0: no limit
  double commits_per_second = 0;       // of all workers, so many at most: tiles get larger; 0: no limit
  size_t max_workers = 4096;
};

/// Lease this tile; one that is leased already is raced for.
struct LeaseOffer {
  JobId job;
  TileId tile;
};
/// Lease this committed tile, to compare.
struct CheckOffer {
  JobId job;
  TileId tile;
};
/// Cut this pending tile into parts, then ask again.
struct SplitOffer {
  JobId job;
  TileId tile;
  std::vector<CellRect> parts;
};
/// Open this round (or the pilot), then ask again.
struct RoundOffer {
  JobId job;
  std::vector<TileSpec> tiles;
};
using Offer = std::variant<std::monostate, LeaseOffer, CheckOffer, SplitOffer, RoundOffer>;

class Scheduler {
 public:
  Scheduler(const SchedulerOptions& options, double lease_seconds)
      : workers(lease_seconds, options.max_workers), options_(options), admission_(options.film_memory_bytes) {}

  WorkerTable workers;

  Job& add(Job job);
  Job* find(const JobId& id);
  const Job* find(const JobId& id) const;
  /// In the order of submission.
  const std::vector<JobId>& order() const { return order_; }
  /// Those that are not final, in the order of submission.
  std::vector<JobId> active() const;
  std::vector<Job*> active_jobs() const;
  /// Takes the job out of the sharing, before its priority changes; it joins again, beside its new equals,
  /// when the next worker asks.
  void withdraw(Job& job);
  /// To be called after record.state was changed.
  void state_changed(const Job& job);

  /// What to do for a worker that asks for work: a tile of the runnable job of highest priority that has (or
  /// can open) something for it; of equal ones the one that has had least (fair_share.h) of those whose films
  /// are in memory together (film_admission.h). A worker gets several tiles of a job in a row, so that neither
  /// its scenes nor the films change with every tile, but a job that has just come begins at once. When a job
  /// comes to its end, pending tiles are cut for those who idle, and then they race those who are late.
  Offer offer(const WorkerId& worker, double now);
  /// To be called when what was offered is leased, and when a lease has ended after `seconds` of processor
  /// time; 0 if it came to nothing.
  void granted(Job& job, const TileRecord& tile);
  void settled(Job& job, TileId tile, int64_t attempt, double seconds);
  /// True if nothing is left to lease or to wait for: the job is done.
  bool complete(const Job& job, double now) const;
  /// The same, but for spot checks.
  bool rendered(const Job& job, double now) const;
  /// True if a worker is there, maybe benched, that could check the tile.
  bool has_checker(const Job& job, TileId tile, double now) const;
  /// Render wall time so far.
  static double wall_seconds(const Job& job, double now);
  static bool time_is_up(const Job& job, double now);
  /// True if a round end asks for a new point of the curve.
  static bool point_due(const Job& job);
  // scheduler_status.cc:
  /// Pixel samples per second over the newest commits; 0 if unknown.
  static double recent_rate(const Job& job, double now);
  static void count_commit(Job& job, double now, double pixel_samples);
  /// Remaining seconds until spp or the time limit, whichever comes first; -1 if unknown.
  static double eta_seconds(const Job& job, double now);
  /// Why nothing happens to a runnable job, or that its pilot runs; mostly empty.
  std::string note(const Job& job, double now) const;

 private:
  bool fits(const Job& job, const Worker& worker) const;
  bool wants_workers(const Job& job) const;
  /// Takes part in the sharing, or ends that.
  void compete(Job& job, bool wants);
  FilmAdmission::Claim claim(const Job& job) const;
  /// Jobs that the worker may work for, the one that comes next first.
  std::vector<Job*> candidates(const Worker& worker);
  Offer offer_of(const Job& job, const WorkerId& worker, double now) const;
  /// No further round is opened before those that there are have ended.
  static bool is_planned_out(const Job& job, double now);
  // scheduler_tail.cc:
  /// Seconds that the worker is expected to take for the tile; negative: unknown.
  static double expected_seconds(const Job& job, const TileSpec& tile, const Worker& worker);
  /// How to cut the tile so that idle workers have something, or that all come to the end at the same time;
  /// empty: not at all.
  std::vector<CellRect> parts_for_idle(const Job& job, TileId tile, const Worker& worker, double now) const;
  /// Fills in the seconds until all that is pending or leased is rendered, were it shared evenly by the
  /// worker and those who hold a tile, and how many these are.
  void share_rest(const Job& job, const Worker& worker, double now, TailCounts* counts) const;
  /// Workers that have nothing to do and fit the job, and how the rest is shared; with many workers as of a
  /// moment ago.
  TailCounts count_tail(const Job& job, const Worker& worker, double now) const;
  /// A tile that somebody has had for too long, or that this worker will have much sooner.
  std::optional<TileId> tile_to_race(const Job& job, const Worker& worker, double now) const;
  /// The first job that this one has to wait for; null: none.
  const Job* waits_for(const Job& job) const;
  int fitting_workers(const Job& job, double now, double* mean_speed) const;
  /// True while what is planned ends at a checkpoint that may turn out to meet the target error.
  static bool awaits_checkpoint(const Job& job);
  /// How large and deep tiles must be so that the commits of all workers stay within the ingest budget.
  void obey_ingest(const Job& job, TilingInput* input) const;
  std::vector<TileSpec> next_round(const Job& job, double now) const;

  SchedulerOptions options_;
  std::map<JobId, Job> jobs_;
  std::vector<JobId> order_;
  std::map<JobId, size_t> rank_;   // place in order_, from 1
  std::map<size_t, Job*> active_;  // by rank
  FairShare shares_;
  FilmAdmission admission_;
};

}  // namespace lightmill
