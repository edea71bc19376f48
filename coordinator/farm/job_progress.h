#pragma once
// How far a job is: its clock, its rate, and when it will be done. Pure.
#include "coordinator/farm/job.h"

namespace lightmill {

/// Render wall time so far.
double wall_seconds(const Job& job, double now);
/// Its time limit is over.
bool time_is_up(const Job& job, double now);
/// So many samples were committed now, for recent_rate().
void count_commit(Job& job, double now, double pixel_samples);
/// Pixel samples per second over the newest commits; 0 if unknown.
double recent_rate(const Job& job, double now);
/// Remaining seconds until spp or the time limit, whichever comes first; -1 if unknown.
double eta_seconds(const Job& job, double now);

}  // namespace lightmill
