#pragma once
// What a farm tells of itself, beside the states of jobs and workers (common/farm/farm_types.h).
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/base/ids.h"
#include "common/farm/farm_types.h"

namespace lightmill {

/// What happened since the start; for metrics.
struct FarmStats {
  uint64_t leases = 0;
  uint64_t leases_expired = 0;
  uint64_t commits = 0;
  uint64_t commits_repeated = 0;
  uint64_t commits_stale = 0;
  uint64_t commits_corrupt = 0;
  uint64_t commit_bytes = 0;
  uint64_t packets = 0;
  uint64_t failures = 0;
  uint64_t pixel_samples = 0;  // of accepted partials, as are the counters
  RenderCounters counters{};
  uint64_t races = 0;             // tiles given to a second worker while the first still had them
  uint64_t tiles_split = 0;       // so that more workers could share them
  uint64_t checks = 0;            // tiles rendered again to compare
  uint64_t liars = 0;             // workers whose pixels were wrong
  uint64_t tiles_taken_back = 0;  // of these workers
  /// What was refused, by reason: "worker_build", "worker_schema", "worker_limit", "job_limit",
  /// "commit_stale", "commit_corrupt", "commit_unknown_job", "spot_check".
  std::map<std::string, uint64_t> refusals;
  uint64_t film_loads = 0;     // merged layers that were read from the store
  double film_bytes = 0;       // taken by those in memory right now
  bool storage_fault = false;  // right now: jobs pause until the disk is mended
};

/// A job or sequence that ended, as hooks are told of it.
struct EndNote {
  std::string id;  // "j7", "s3"
  int count = 1;   // it may end again, once extended or retried
  bool operator==(const EndNote&) const = default;
};

/// Some of all jobs, for views of the whole farm.
struct JobPage {
  std::vector<JobStatus> jobs;
  size_t total = 0;      // jobs that the farm knows
  uint64_t version = 0;  // of the newest change so far
};

/// The end of a job's ledger: the tiles of its last complete round and of all later ones.
struct TileMap {
  int64_t complete_samples = 0;             // every pixel has the samples below
  std::vector<TileStatus> tiles;            // ascending by id, without digests
  std::map<TileId, double> leased_seconds;  // of those that are leased, since the oldest lease
};

}  // namespace lightmill
