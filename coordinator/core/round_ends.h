#pragma once
// What the end of a round brings: a point of the error curve, the stop rules, and after the last round the
// end of the job.
//
// The caller of any method but complete_jobs() must not hold FarmState::mutex. With `layers` it holds that
// job's.
#include <optional>
#include <vector>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/repair/storage_guard.h"

namespace lightmill {

class RoundEnds {
 public:
  RoundEnds(FarmState& farm, JobTable& jobs, StorageGuard& storage)
      : farm_(farm), jobs_(jobs), storage_(storage) {}

  /// Does what is due for the job; nothing where a round has not ended.
  void settle(const JobId& id, Merger::Open& layers);
  /// The same for all jobs that are complete. What fails is logged: a later tick tries again.
  void settle_complete();
  /// Jobs that only wait for their end. Wants FarmState::mutex held.
  std::vector<JobId> complete_jobs(double now) const;

 private:
  /// What settle() does next.
  struct Due {
    bool anything = false;
    bool new_point = false;   // of the curve
    bool image_mean = false;  // something was dropped: its share is of that
  };
  /// Fills in the point but for its errors.
  Due look(const JobId& id, const Merger::Open& layers, ErrorPoint* point);
  /// Stores the point, if it is new, and applies the stop rules. True if the job has ended by that.
  bool apply(const JobId& id, const ErrorPoint& point, bool is_new, std::optional<double> image_mean);

  FarmState& farm_;
  JobTable& jobs_;
  StorageGuard& storage_;
};

}  // namespace lightmill
