#pragma once
// Why nothing happens to a job, for whoever watches it.
#include <string>

#include "coordinator/farm/scheduler.h"

namespace lightmill {

/// Why nothing happens to a runnable job, or that its pilot runs; mostly empty.
std::string waiting_note(const Scheduler& scheduler, const Job& job, double now);

}  // namespace lightmill
