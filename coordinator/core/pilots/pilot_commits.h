#pragma once
// The commit of a job's pilot: what it chose becomes part of the job's settings, for good, in the transaction
// that checks the attempt token.
#include <cstddef>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/leases.h"

namespace lightmill {

class PilotCommits {
 public:
  PilotCommits(FarmState& farm, Leases& leases) : farm_(farm), leases_(leases) {}

  /// Takes a result that was decoded from `bytes` bytes. The lease is pinned; FarmState::mutex is not held.
  CommitResult commit(const WorkerId& worker, const LeaseKey& lease, const PilotResult& result, size_t bytes);

 private:
  FarmState& farm_;
  Leases& leases_;
};

}  // namespace lightmill
