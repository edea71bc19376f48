#pragma once
// What the farm does while its disk fails: jobs pause with the reason, nothing is leased or folded, and a
// tick looks whether it is mended. Where only one job's layers are damaged, that job pauses alone.
//
// The caller of any method but require() must not hold FarmState::mutex.
#include <optional>
#include <string>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"

namespace lightmill {

class StorageGuard {
 public:
  StorageGuard(FarmState& farm, JobTable& jobs) : farm_(farm), jobs_(jobs) {}

  /// Throws StoreError while the store is at fault. With or without FarmState::mutex.
  void require() const;
  /// The job's layers, locked. If they can't be read the job pauses, and what was thrown passes on.
  Merger::Open open_layers(const JobId& id, const RenderSettings& settings);
  /// The same for a job by its id; throws UnknownJob.
  Merger::Open open_layers(const JobId& id);
  /// Looks whether the store, and jobs whose layers could not be read, are mended.
  void look_again();

 private:
  /// True if the store works, maybe again.
  bool store_works();
  /// Says so, and stops the clocks, when a fault is seen for the first time. Wants FarmState::mutex held.
  void pause_all(const std::string& fault, double now);
  void look_at_damaged_jobs();

  FarmState& farm_;
  JobTable& jobs_;
  std::optional<std::string> logged_fault_;  // guarded by FarmState::mutex
};

}  // namespace lightmill
