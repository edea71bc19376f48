#pragma once
// What workers ask for: to register, a lease, its renewal, and to say that they failed or leave. Commits take
// CommitPath. Farm's methods of the same names say what each does.
//
// The caller must not hold FarmState::mutex.
#include <optional>
#include <string>
#include <vector>

#include "coordinator/core/farm_state.h"
#include "coordinator/core/job_table.h"
#include "coordinator/core/leases.h"
#include "coordinator/core/round_ends.h"

namespace lightmill {

class WorkerDesk {
 public:
  WorkerDesk(FarmState& farm, JobTable& jobs, Leases& leases, RoundEnds& ends)
      : farm_(farm), jobs_(jobs), leases_(leases), ends_(ends) {}

  WorkerId register_worker(const WorkerRegistration& registration, const std::string& owner);
  void turned_away(const std::string& reason);
  std::optional<LeaseGrant> lease(const WorkerId& worker, double wait_s);
  std::optional<LeaseGrant> lease_at_once(const WorkerId& worker);
  std::vector<LeaseKey> renew(const WorkerId& worker, const std::vector<LeaseKey>& held);
  void fail(const WorkerId& worker, const LeaseKey& lease, const std::string& reason, FailureKind kind);
  void warn(const WorkerId& worker, const LeaseKey& lease, const std::vector<std::string>& missing_light);
  void show(const WorkerId& worker, const LeaseKey& lease, Image picture);
  void hand_back(const WorkerId& worker, const LeaseKey& lease);
  void drain(const WorkerId& worker);
  bool is_proven(const WorkerId& worker) const;

 private:
  // FarmState::mutex held:
  Worker& get(const WorkerId& id);  // throws UnknownWorker
  /// The worker asks for a tile now; false if it gets none whatever there is.
  bool may_ask(Worker& worker, double now);
  /// The job whose lease the worker holds; null if it holds it no more.
  Job* job_of(const WorkerId& worker, const LeaseKey& lease);
  /// The worker ran out of memory over a tile of this job.
  void lacks_memory(Job& job, const WorkerId& worker);

  FarmState& farm_;
  JobTable& jobs_;
  Leases& leases_;
  RoundEnds& ends_;
};

}  // namespace lightmill
