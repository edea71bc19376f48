#pragma once
// Why nothing happens to a job, for whoever watches it. Pure.
#include "coordinator/farm/waiting/turns.h"

namespace lightmill {

/// Why nothing happens to a runnable job, or that its pilot runs; mostly empty.
WaitingNote waiting_note(const Scheduler& scheduler, Turns& turns, const Job& job, double now);

}  // namespace lightmill
