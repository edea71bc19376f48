#pragma once
// The end of a job, when there is less to do than there are workers: tiles are cut for those who idle, and
// whoever is late is raced. And the end of a lease whose holder will not come to one. Pure, but for counts
// that it keeps in Job::tail.
#include <optional>
#include <vector>

#include "coordinator/farm/job.h"
#include "coordinator/farm/scheduler_options.h"

namespace lightmill {

class JobTail {
 public:
  JobTail(const WorkerTable& workers, const SchedulerOptions& options)
      : workers_(workers), options_(options) {}

  /// How to cut the tile so that idle workers have something, or that all come to the end at the same time;
  /// empty: not at all.
  std::vector<CellRect> parts_for_idle(const Job& job, TileId tile, const Worker& worker, double now) const;
  /// The pilot, or a tile of the last rounds, that somebody has had for too long, or that this worker will
  /// have much sooner. While all who race for a tile are late, another one may join them: so a tile is
  /// rendered in the end, however many hold it and do nothing. `patience`: lateness counts from so many times
  /// the usual one.
  std::optional<TileId> tile_to_race(const Job& job, const Worker& worker, double now, double patience) const;
  /// Leases that have lasted for so long that others should have their tiles; none if there are no others.
  /// `undisturbed_since`: since when workers could have committed.
  std::vector<LeaseTable::Lease> overdue(const Job& job, double undisturbed_since, double now) const;

 private:
  /// Seconds after which the holder of a lease is late.
  double late_after(const Job& job, const LeaseTable::Lease& lease) const;
  /// The same for all who have this tile: when one more may join them.
  bool may_join(const Job& job, const std::vector<LeaseTable::Lease>& leases, const Worker& worker,
                double now, double patience) const;
  /// Fills in the seconds until all that is pending or leased is rendered, were it shared evenly by the
  /// worker and those who hold a tile, and how many these are.
  void share_rest(const Job& job, const Worker& worker, double now, TailCounts* counts) const;
  /// Workers that have nothing to do and fit the job, and how the rest is shared; with many workers as of a
  /// moment ago.
  TailCounts count_tail(const Job& job, const Worker& worker, double now) const;

  const WorkerTable& workers_;
  SchedulerOptions options_;
};

}  // namespace lightmill
