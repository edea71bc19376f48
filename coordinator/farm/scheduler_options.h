#pragma once
// What the scheduler is told when it starts.
#include <cstddef>

namespace lightmill {

struct SchedulerOptions {
  double target_tile_seconds = 1;
  double film_memory_bytes = 0x1p30;
  double ingest_bytes_per_second = 0;  // that all commits together may bring; 0: no limit
  double commits_per_second = 0;       // of all workers, so many at most: tiles get larger; 0: no limit
  size_t max_workers = 4096;
  double lease_seconds = 10;
  double unix_offset = 0;  // what the clock's seconds lack of the seconds since 1970, for deadlines
};

}  // namespace lightmill
