#pragma once
// Names by which workers call. All may know that there is a worker w12, but only who registered as w12 may
// take leases, fail, hand back or drain in its name: it calls itself "w12.<key>".
#include <string>

#include "common/base/ids.h"

namespace lightmill {

/// Immutable. The keys are good for this process: after a restart workers register again.
class WorkerKeys {
 public:
  WorkerKeys();
  std::string name_of(const WorkerId& worker) const;
  /// Inverse. Throws UnknownWorker if the key is not the worker's.
  WorkerId worker_of(const std::string& name) const;
  /// The part that all may know, right or not: for lines of a log, and for commits, which leases decide.
  static WorkerId shown(const std::string& name);

 private:
  std::string key_of(const WorkerId& worker) const;
  const std::string secret_;
};

}  // namespace lightmill
