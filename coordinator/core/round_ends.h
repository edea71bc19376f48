#pragma once
// What the end of a round brings: a point of the error curve, the stop rules, and after the last round the
// end of the job.
//
// The caller of any method but complete_jobs() must not hold FarmState::mutex. With `layers` it holds that
// job's.
#include <optional>
#include <vector>

#include "coordinator/core/denoised/denoised_errors.h"
#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/repair/storage_guard.h"

namespace lightmill {

class RoundEnds {
 public:
  RoundEnds(FarmState& farm, JobTable& jobs, StorageGuard& storage)
      : farm_(farm),
        jobs_(jobs),
        storage_(storage),
        denoiser_(farm.options.denoise_threads,
                  [this](const JobId& id, const ErrorPoint& point, const std::string& failure) {
                    apply_denoised(id, point, failure);
                  }) {}

  /// Does what is due for the job; nothing where a round has not ended.
  void settle(const JobId& id, Merger::Open& layers);
  /// The same for all jobs that are complete. What fails is logged: a later tick tries again.
  void settle_complete();
  /// Jobs whose next round waits for the error of their denoised image, which nobody estimates: after a
  /// restart, or where there was no room. Called by a timer.
  void look_at_waiting();
  /// Jobs that only wait for their end. Wants FarmState::mutex held.
  std::vector<JobId> complete_jobs(double now) const;

 private:
  /// What settle() does next.
  struct Due {
    bool anything = false;
    bool new_point = false;   // of the curve
    bool image_mean = false;  // something was dropped: its share is of that
    bool denoised = false;    // the error of the denoised image is to be estimated
  };
  /// Fills in the point but for its errors.
  Due look(const JobId& id, const Merger::Open& layers, ErrorPoint* point);
  /// Stores the point, if it is new, and applies the stop rules. True if the job has ended by that.
  bool apply(const JobId& id, const ErrorPoint& point, bool is_new, std::optional<double> image_mean);

  /// What fails is logged.
  void settle_one(const JobId& id);
  /// The point comes back with the error of the denoised image, or why there is none.
  void apply_denoised(const JobId& id, const ErrorPoint& point, const std::string& failure);
  /// Wants FarmState::mutex held. `complete`: the job ends with these samples.
  bool wants_denoised_error(const Job& job, double spp, bool complete) const;

  FarmState& farm_;
  JobTable& jobs_;
  StorageGuard& storage_;
  DenoisedErrors denoiser_;  // last: its thread uses the others
};

}  // namespace lightmill
