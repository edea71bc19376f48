#pragma once
// When the turns of jobs come that wait behind others, if all goes on as it does now. Pure.
//
// Work is counted in processor seconds: what a job lacks, by what its samples have cost so far. The farm does
// as much of it a second as its jobs did lately. A job of lower priority, or one that stands behind jobs that
// will miss their deadlines, waits until those before it are done; one that has had more than others waits
// until they have had as much. What is not known of one that counts makes the answer unknown: a job without
// samples, or one without a total and without a time limit.
#include <cstddef>
#include <vector>

#include "coordinator/farm/scheduler.h"

namespace lightmill {

struct TurnEstimate {
  double seconds = -1;      // until a worker takes a tile of it; -1: unknown
  double end_seconds = -1;  // until it is done; -1: unknown
  size_t ahead = 0;         // jobs and sequences before it
};

/// One for each of `turns`, which are in their order (Scheduler::turns).
std::vector<TurnEstimate> estimate_turns(const Scheduler& scheduler, const std::vector<Turn>& turns,
                                         double now);

}  // namespace lightmill
