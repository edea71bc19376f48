#pragma once
// The farm as clients, the dashboard and metrics see it: states of jobs, tiles and workers. Nothing is
// changed here, but that the curve of a job that ended before a restart is loaded when somebody looks. Farm's
// methods of the same names say what each does.
//
// The caller of any method but status() must not hold FarmState::mutex. Each answer is of one moment; pages
// keep the lock short.
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"
#include "coordinator/farm/waiting/turns.h"

namespace lightmill {

class FarmView {
 public:
  FarmView(FarmState& farm, JobTable& jobs) : farm_(farm), jobs_(jobs) {}

  std::vector<JobStatus> jobs(size_t begin, size_t count, bool frames = true) const;
  std::vector<JobStatus> newest_jobs() const;
  size_t job_count() const;
  JobPage page(size_t begin, size_t count, uint64_t version, bool waiting, bool frames) const;
  JobStatus job(const JobId& id) const;
  JobStatus wait(const JobId& id, uint64_t version, double timeout_s) const;
  std::vector<TileStatus> tiles(const JobId& id) const;
  TileMap tile_map(const JobId& id) const;
  std::vector<std::pair<WorkerId, LeaseKey>> holdings() const;
  WorkerPage workers(const WorkerId& after, size_t most) const;
  TimelinePage timelines(const WorkerId& after, size_t most, int64_t since) const;
  FarmStats stats() const;

  /// Packets of the whole job; of one that stopped before its samples (time, target) those that it has.
  static int64_t packets_total(const JobRecord& job);
  /// Wants FarmState::mutex held.
  JobStatus status(const Job& job, double now) const;

 private:
  void add_notes(const Job& job, double now, JobStatus* status) const;

  FarmState& farm_;
  JobTable& jobs_;
  mutable Turns turns_;  // guarded by FarmState::mutex
};

}  // namespace lightmill
