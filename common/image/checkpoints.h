#pragma once
// The samples per pixel at which a job with a target error is looked at: fixed beforehand, so that neither
// the speed of the workers nor what the image looks like decides how often the question is put.
//
// 1, 2, 4, 8, 16, 32, 48, 64 spp, then each at most 1.25 times the one before it (and one superblock at
// least).
#include <algorithm>
#include <cstdint>

#include "common/image/grid.h"

namespace lightmill {

/// The first checkpoint after `spp` samples per pixel (spp >= 0).
constexpr int64_t next_checkpoint(int64_t spp) {
  if (spp < kSuperblockSamples) return block_end(block_of_sample(spp));
  const int64_t done = spp / kSuperblockSamples;
  int64_t superblocks = 1;
  while (superblocks <= done) superblocks = std::max(superblocks + 1, superblocks * 5 / 4);
  return superblocks * kSuperblockSamples;
}

}  // namespace lightmill
