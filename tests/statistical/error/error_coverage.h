#pragma once
// Whether error estimates keep their promises: repeated runs of a scene, each judged against all the others.
#include <array>
#include <string>
#include <vector>

#include "common/error/error_curve.h"
#include "tests/statistical/error/error_scenes.h"

namespace lightmill::test {

/// What an estimate was worth, over all runs. True errors are those of the run's own image against the mean
/// of all other runs at their ends.
struct Coverage {
  int runs = 0, covered = 0;  // runs with an interval, and those of them whose interval holds the true error
  double bias = 0;            // mean estimate / mean true error - 1
  double width = 0;           // mean upper half of the interval / mean estimate
};

struct CheckpointCoverage {
  int64_t spp = 0;
  int batches = 0;
  Coverage pixels;
  std::array<Coverage, kBoxSides.size()> boxes;  // empty where no box fits
};

/// --target-error E, where E is the mean true error at `needed` spp: every run stops at its first checkpoint
/// whose interval ends below E.
struct StopRule {
  double target = 0;
  int64_t needed = 0;
  int runs = 0, kept = 0;     // and those whose image, where they stop, has a true error below E
  int unfinished = 0;         // never stopped: counted as kept, at their last checkpoint
  double median_samples = 0;  // where they stop / needed
};

struct CoverageResult {
  std::vector<CheckpointCoverage> checkpoints;
  StopRule stop;
};

/// `runs` runs with seeds from `first_seed` on, of `superblocks` superblocks each; `needed` superblocks
/// suffice for the stop rule's target.
CoverageResult measure_coverage(const ErrorScene& scene, int runs, int64_t superblocks, int64_t needed,
                                int threads, uint64_t first_seed = 1000);

}  // namespace lightmill::test
