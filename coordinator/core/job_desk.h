#pragma once
// What clients do to jobs: submit, pause, resume, cancel, retry, reorder, extend. Farm's methods of the same
// names say what each does; all throw UnknownJob.
//
// The caller must not hold FarmState::mutex.
#include <cstdint>
#include <optional>
#include <vector>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/round_ends.h"

namespace lightmill {

class JobDesk {
 public:
  JobDesk(FarmState& farm, JobTable& jobs, RoundEnds& ends) : farm_(farm), jobs_(jobs), ends_(ends) {}

  JobId submit(const JobRequest& request);
  /// The row of a new job but for its id. Throws Error(kUsage) if the request is out of range; whether jobs
  /// that it names exist is another question.
  static JobRecord record_of(const JobRequest& request);
  void pause(const JobId& id);
  void resume(const JobId& id);
  void cancel(const JobId& id);
  void retry(const JobId& id);
  void set_priority(const JobId& id, int priority);
  void extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
              std::optional<double> target_error);

  // FarmState::mutex held:
  /// Throws LimitReached unless so many jobs may come, of which so many count as open.
  void require_room(size_t jobs, size_t open);
  /// Throws UnknownJob unless each is a job or a sequence.
  void require_known(const std::vector<JobId>& earlier);
  // The job's row after the change; empty if its state does not allow it.
  static std::optional<JobRecord> paused(const Job& job, double now);
  static std::optional<JobRecord> resumed(const Job& job);
  std::optional<JobRecord> retried(Job& job);
  /// With new totals. Throws Error(kUsage) if they would cut what is planned.
  JobRecord extended(Job& job, const RenderSettings& totals, double now);
  /// The settings with new totals in place of the old ones. Throws Error(kUsage) if they are out of range.
  static RenderSettings with_totals(RenderSettings settings, std::optional<int64_t> spp,
                                    std::optional<double> time_s, std::optional<double> target_error);

 private:
  // FarmState::mutex held:
  /// Tiles of the job have not failed, from now on.
  void forgive_tiles(Job& job);

  FarmState& farm_;
  JobTable& jobs_;
  RoundEnds& ends_;
};

}  // namespace lightmill
