#pragma once
// What a farm is told when it starts.
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "common/base/ids.h"
#include "common/farm/farm_types.h"

namespace lightmill {

struct FarmOptions {
  std::string build;  // a worker with another build is refused
  int schema = 0;
  double lease_seconds = 10;
  double target_tile_seconds = 1.0;
  int max_attempts = 5;                 // of a tile that workers report as failed
  size_t max_open_jobs = 10000;         // neither done, failed nor cancelled
  double checkpoint_bytes = 256e6;      // fold the spool into a film snapshot when it is larger
  double film_memory_bytes = 0x1p30;    // for the merged layers of jobs (film_bytes.h)
  double decode_memory_bytes = 0x1p29;  // for partials that are unpacked at once; a larger one is alone
  double ingest_bytes_per_second = 0;   // that tile sizes obey; 0: no limit
  double commits_per_second = 1000;     // that tile sizes obey, well below what one bears; 0: no limit
  size_t max_workers = 4096;            // registered and alive
  /// What the clock lacks of the seconds since 1970; not given: what it is when the farm starts.
  std::optional<double> unix_offset{};
  int spot_check = 0;  // one in so many committed tiles is rendered again by another worker; 0: none
  uint64_t spot_check_seed = 0;  // of the draw of these tiles; 0: one that no worker can foretell
  /// Jobs that record what denoising goes by get the error of the denoised image on their curves. Those whose
  /// target it is do so in any case.
  bool denoised_errors = true;
  int denoise_threads = 1;  // for that
  bool tells_ends = false;  // ends of jobs are kept for Farm::untold_ends() until they are told
  /// Receives one line about what an operator should know (refused partials, lost leases); may be empty.
  std::function<void(const std::string&)> log;
  /// Keeps a refused partial as evidence: (lease, worker, reason, bytes); may be empty. What it throws is
  /// logged.
  std::function<void(const LeaseKey&, const WorkerId&, const std::string&, const std::string&)> quarantine;
};

}  // namespace lightmill
