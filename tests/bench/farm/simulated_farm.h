#pragma once
// A farm of fake workers on a simulated clock: scheduler, leases and merger are the real ones, workers have
// drawn speeds, come late, die and return, over a network that costs time. What takes real time here are the
// coordinator's own decisions, decoding and folding, which is measured. All else follows from the seed.
//
//   const SimulationResult result = simulate({.workers = 1000, .seconds = 600});
#include <cstdint>

#include "common/job/settings.h"

namespace lightmill {

struct SimulationOptions {
  int workers = 100;
  double seconds = 60;  // what the job would take if nothing was ever lost
  int64_t spp = 4096;   // at least
  uint64_t seed = 1;
  int width = 0, height = 0;  // pixels; 0: 960x540, of large farms 1920x1080
  Integrator integrator = Integrator::kPt;
  bool trouble = true;                    // workers of different speeds come late, die and return
  double line_bytes_per_second = 12.5e6;  // of a worker's
  // Of a worker's processor, of what it hands in: packing and sending, on a core that the coordinator shares
  // also what that does with it.
  double seconds_per_byte = 0;
  // Processor time of one lease and one commit outside of the farm's core (gRPC, the disk), and of a renewal.
  double rpc_seconds = 0.4e-3, renew_seconds = 0.1e-3;
  double lease_seconds = 10, commits_per_second = 1000;  // FarmOptions
};

struct SimulationResult {
  double seconds = 0;         // until the last tile was committed
  double alive_seconds = 0;   // of all workers together
  double useful_seconds = 0;  // of that for tiles that count
  double lost_seconds = 0;    // for tiles that were lost to deaths and races
  double tail_seconds = 0;    // since the first worker found nothing to do for good
  double commit_bytes = 0;
  int64_t leases = 0, commits = 0, renewals = 0;  // calls
  int deaths = 0;
  uint64_t tiles_split = 0, races = 0;
  // Of this machine's processors, measured in the farm's core:
  double lease_core_seconds = 0, commit_core_seconds = 0, renewal_core_seconds = 0;
  double film_bytes = 0;  // of the job's layers

  double efficiency() const { return useful_seconds / alive_seconds; }
  /// Processors that tiles keep busy, leases and commits with their RPCs; and what renewals do.
  double tile_load(const SimulationOptions& options) const;
  double renewal_load(const SimulationOptions& options) const;
};

/// Throws Error(kFailed) if the job fails.
SimulationResult simulate(const SimulationOptions& options);

}  // namespace lightmill
