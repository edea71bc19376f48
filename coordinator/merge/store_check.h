#pragma once
// Checks what must be true of a job whatever happened: every committed tile was folded exactly once, and the
// totals are those of the ledger. `lightmill-coordinator --check` does this for a whole data folder.
#include <string>
#include <vector>

#include "common/film/film.h"
#include "coordinator/farm/job_record.h"

namespace lightmill {

class JobStore;

/// Throws Error(kFailed) with the first cell whose samples in the film are not those of the committed tiles.
void check_film(const JobId& job, const RenderSettings& settings, const std::vector<TileRecord>& tiles,
                const Film& film);

/// Loads the layers of every job and compares them with its ledger and its totals. One line per problem;
/// empty if everything agrees. Throws StoreError if the store can't be read.
std::vector<std::string> check_store(JobStore& store);

}  // namespace lightmill
