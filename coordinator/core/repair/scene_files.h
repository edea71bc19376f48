#pragma once
// Jobs whose scene files the coordinator has lost. They say so, and go on with the workers that have the
// files. Once a worker asks for one in vain the job pauses, so that its tiles do not fail, until the file is
// back.
//
// Wants FarmState::mutex not held.
#include <string>
#include <vector>

#include "coordinator/core/farm_state.h"

namespace lightmill {

class SceneFiles {
 public:
  explicit SceneFiles(FarmState& farm) : farm_(farm) {}

  /// Digests of the bundles of all jobs that have not ended, ascending.
  std::vector<std::string> open_bundles() const;
  /// The bundle of the lease's job; empty if the worker does not hold the lease.
  std::string bundle_of(const WorkerId& worker, const LeaseKey& lease) const;
  /// What is missing of this bundle, for people; empty: nothing. `in_vain`: a worker has asked for it.
  void set_missing(const std::string& bundle_digest, const std::string& what, bool in_vain);

 private:
  void set_missing(Job& job, const std::string& what, bool in_vain);

  FarmState& farm_;
};

}  // namespace lightmill
