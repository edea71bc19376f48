#pragma once
// What one caller may ask of the coordinator. The bounds of a single message are in common/rpc/channel.h;
// those of partials follow from their tile (Farm::announce_commit).
#include <cstdint>

#include "common/farm/farm_types.h"

namespace lightmill {

struct Quotas {
  int64_t max_pixels = kMaxPixels;                 // of a job's resolution
  uint64_t max_bundle_bytes = uint64_t{64} << 30;  // of all files of a scene, and of one upload
  double submissions_per_minute = 600;             // of one token; in plain text of all callers together
  int max_connections = 10000;                     // to the gRPC port
  double connections_per_second = 200;             // of one address, after five times as many at once
  uint64_t incoming_bytes = uint64_t{1} << 29;     // of all partials being received; a larger one comes alone
  double stall_seconds = 60;  // that a peer may be silent when it is its turn (stall_watch.h)
};

/// Throws LimitReached if the job is larger than allowed, Error(kUsage) if a file's stated size is
/// impossible.
void check_quotas(const Quotas& quotas, const JobRequest& job);

}  // namespace lightmill
