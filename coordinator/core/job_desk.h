#pragma once
// What clients do to jobs: submit, pause, resume, cancel, retry, reorder, extend. Farm's methods of the same
// names say what each does; all throw UnknownJob.
//
// The caller must not hold FarmState::mutex.
#include <cstdint>
#include <optional>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/round_ends.h"

namespace lightmill {

class JobDesk {
 public:
  JobDesk(FarmState& farm, JobTable& jobs, RoundEnds& ends) : farm_(farm), jobs_(jobs), ends_(ends) {}

  JobId submit(const JobRequest& request);
  void pause(const JobId& id);
  void resume(const JobId& id);
  void cancel(const JobId& id);
  void retry(const JobId& id);
  void set_priority(const JobId& id, int priority);
  void extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
              std::optional<double> target_error);

 private:
  // FarmState::mutex held:
  /// Throws LimitReached if there are as many jobs as may be.
  void require_room();
  /// Tiles of the job have not failed, from now on.
  void forgive_tiles(Job& job);
  /// The job goes on with these settings; they must not cut what is planned.
  void apply_settings(Job& job, const RenderSettings& settings);

  FarmState& farm_;
  JobTable& jobs_;
  RoundEnds& ends_;
};

}  // namespace lightmill
