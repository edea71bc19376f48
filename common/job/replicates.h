#pragma once
// Which random numbers a superblock of samples has.
//
// A pixel, and the light paths of a packet, have one low-discrepancy sequence for the whole job in each of
// two *replicates*, whose scrambles are independent. The error of the image is estimated from how the
// replicates differ (common/error/error_estimate.cc). A sequence converges faster than independent samples,
// as long as it goes on: so there are no more than two, and each is good at powers of two.
//
// Superblocks are given to the replicates in turn, in runs: A, B; A, B; A A, B B; four each; and so on. So at
// powers of two each has half of them, and in between one has at most twice as many. Tiles must not mix the
// two; a tile of a long job can still be deep.
#include <cstdint>

namespace lightmill {

inline constexpr int kReplicates = 2;
/// Samples per pixel from which on both replicates have some, so that halves of the samples are independent.
inline constexpr double kIndependentHalvesSpp = 32;

/// A superblock's place: the number of the replicate, and of the superblock within it.
struct ReplicateBlock {
  int replicate = 0;
  int64_t superblock = 0;
  bool operator==(const ReplicateBlock&) const = default;
};

/// Superblocks of the run of superblock `k` (k >= 0).
constexpr int64_t replicate_run(int64_t k) {
  int64_t run = 1;
  while (4 * run <= k) run *= 2;
  return run;
}
constexpr ReplicateBlock replicate_of(int64_t k) {
  const int64_t run = replicate_run(k);
  return {static_cast<int>(k / run % kReplicates), k < kReplicates ? 0 : run + k % run};
}
/// The end of the run of superblock `k`: those from k on, before it, follow one another in one replicate.
constexpr int64_t replicate_run_end(int64_t k) {
  const int64_t run = replicate_run(k);
  return (k / run + 1) * run;
}

}  // namespace lightmill
