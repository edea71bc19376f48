#pragma once
// When a job gets its next round, and of which tiles; and which round ends are looked at (checkpoints). Pure.
#include <vector>

#include "coordinator/farm/job.h"
#include "coordinator/farm/scheduler_options.h"
#include "coordinator/farm/tiling.h"

namespace lightmill {

/// Workers that may work now and fit the job. `mean_speed`, if given: samples a second of those of them that
/// were measured; 0: of none.
int fitting_workers(const WorkerTable& workers, const Job& job, double now, double* mean_speed = nullptr);
/// No further round is opened before those that there are have ended.
bool is_planned_out(const Job& job, double now);
/// The job waits for the error of its denoised image: it neither ends nor gets another round before.
bool awaits_denoised_error(const Job& job);
/// True if a round end asks for a new point of the curve.
bool point_due(const Job& job);

class RoundPlanner {
 public:
  RoundPlanner(const WorkerTable& workers, const SchedulerOptions& options)
      : workers_(workers), options_(options) {}

  /// The tiles of the job's next round, or its pilot; empty: none now.
  std::vector<TileSpec> next_round(const Job& job, double now) const;

 private:
  /// How large and deep tiles must be so that the commits of all workers stay within the ingest budget.
  void obey_ingest(const Job& job, TilingInput* input) const;

  const WorkerTable& workers_;
  SchedulerOptions options_;
};

}  // namespace lightmill
