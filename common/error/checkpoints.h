#pragma once
// The samples per pixel at which a job with a target error is checked. They are fixed beforehand, so neither
// the speed of the workers nor the content of the image decides how often that happens.
//
// Frequent checks make it likelier to stop too early: one check errs in 2.5 % of the jobs, and each check in
// other jobs. But a check can err only where the true error is within an interval's width above the target.
// That is one or two checks, as the error falls by a quarter from one to the next. And where it stops, the
// error is mostly below the target, as the whole interval is. Measured by tests/bench/planning/error_coverage
// --all over 6 scenes x 200 runs: the error of the image is below the target in 99.5 %, at 1.25 times the
// samples that the target takes in the median (a caustic: 1.5 or 1.8 times). So the level of a check needs no
// correction.
//
// Checkpoints are 1, 2, 4, 8, 16, 32, 48, 64 spp, then each at most 1.25 times the one before it (and at
// least one superblock further).
#include <algorithm>
#include <cstdint>

#include "common/job/packet_grid.h"

namespace lightmill {

/// The first checkpoint after `spp` samples per pixel (spp >= 0).
constexpr int64_t next_checkpoint(int64_t spp) {
  if (spp < kSuperblockSamples) return block_end(block_of_sample(spp));
  const int64_t done = spp / kSuperblockSamples;
  int64_t superblocks = 1;
  while (superblocks <= done) superblocks = std::max(superblocks + 1, superblocks * 5 / 4);
  return superblocks * kSuperblockSamples;
}

/// Likewise of a job whose target is the error of the denoised image: 32 spp, then twice as many each time.
/// At these both replicates have half of the samples (common/job/replicates.h), and denoising takes long.
constexpr int64_t next_denoised_checkpoint(int64_t spp) {
  int64_t checkpoint = 2 * kSuperblockSamples;
  while (checkpoint <= spp) checkpoint *= 2;
  return checkpoint;
}

}  // namespace lightmill
