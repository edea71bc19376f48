#pragma once
// How far a job is: its clock, its rate, and when it will be done. Pure.
#include "coordinator/farm/job.h"

namespace lightmill {

/// Render wall time so far.
double wall_seconds(const Job& job, double now);
/// Its time limit is over.
bool time_is_up(const Job& job, double now);
/// So many samples were committed now, for recent_rate().
void count_commit(RecentSamples& recent, double now, double pixel_samples);
/// Pixel samples per second over the newest commits; 0 if unknown.
double recent_rate(const RecentSamples& recent, double now);
/// The job's totals with one more tile, whose encoded partial has so many bytes.
JobRecord with_partial(JobRecord record, const Partial& partial, const TileSpec& tile, size_t bytes);
/// The job's record as if nothing was committed.
JobRecord without_partials(JobRecord record);
/// The record with what `other` says of the committed tiles.
JobRecord with_totals_of(JobRecord record, const JobRecord& other);
/// Remaining seconds until spp or the time limit, whichever comes first; -1 if unknown.
double eta_seconds(const Job& job, double now);
/// The same, or until the target, to which the error falls as 1/time; -1 if unknown.
double seconds_left(const Job& job, double now);

}  // namespace lightmill
