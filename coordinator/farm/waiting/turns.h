#pragma once
// Which job comes before a job that waits, and why: read off the scheduler's own order. Pure.
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "coordinator/farm/scheduler.h"
#include "coordinator/farm/waiting/turn_estimate.h"

namespace lightmill {

/// Why nothing happens to a job.
struct WaitingNote {
  std::string why;           // a clause, for people; empty: it does not wait
  JobId behind;              // the job that it waits for; empty: for none
  double turn_seconds = -1;  // until its turn comes, about; -1: unknown
  double end_seconds = -1;   // until it is done, about; -1: unknown
};

/// Orders are kept for a second: ten thousand jobs ask one after the other, and each costs a sort of all.
class Turns {
 public:
  /// Of a job that wants workers, with `worker` one that may work for it: which job is before it.
  WaitingNote note(const Scheduler& scheduler, const Job& job, const Worker& worker, double now);

 private:
  static constexpr double kKeptSeconds = 1;
  static constexpr size_t kMostLines = 16;  // kinds of workers; more are not told of
  /// What one worker would take, in order.
  struct Line {
    double made_at = 0;  // clock time
    std::vector<Turn> turns;
    std::vector<TurnEstimate> estimates;  // of each turn
    std::unordered_map<const Job*, size_t> places;
    const Job* next = nullptr;  // gets its next tile leased; null: none
  };
  const Line* line(const Scheduler& scheduler, const Worker& worker, double now);

  std::map<WorkerId, Line> lines_;
};

}  // namespace lightmill
