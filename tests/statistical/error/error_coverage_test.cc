// The error estimate's 95 % interval holds the true error, and a target error is kept: a small version of
// tests/bench/planning/error_coverage, over six scenes together.
//
// 6 x 10 runs: 95 % is 57 of 60 with a standard deviation of 1.7 (binomial); four of them below is 50. An
// interval of Student's t over the batches' errors alone, which does not know how the one image at hand
// scatters, holds about half of them from 12 batches on, and would fail. The same of the 36 boxes of 4x4, by
// whose few values an interval is wide and no normal one.
#include "tests/statistical/error/error_coverage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

namespace lightmill::test {
namespace {

constexpr int kRuns = 10;
constexpr int64_t kSuperblocks = 14;
constexpr int64_t kNeeded = 8;

TEST(ErrorCoverage, IntervalsHoldAndTargetsAreKept) {
  std::map<int, Coverage> by_batches, boxes_by_batches;
  std::vector<double> medians;
  int runs = 0, kept = 0;
  for (const ErrorScene& scene : error_scenes(24)) {
    SCOPED_TRACE(scene.name);
    const CoverageResult result = measure_coverage(scene, kRuns, kSuperblocks, kNeeded, 1);
    for (const CheckpointCoverage& c : result.checkpoints) {
      if (c.batches < 4) {
        EXPECT_EQ(c.pixels.runs, 0) << "no interval is claimed";
        continue;
      }
      EXPECT_EQ(c.pixels.runs, kRuns);
      Coverage& sum = by_batches[c.batches];
      sum.runs += c.pixels.runs;
      sum.covered += c.pixels.covered;
      boxes_by_batches[c.batches].runs += c.boxes[0].runs;
      boxes_by_batches[c.batches].covered += c.boxes[0].covered;
      EXPECT_EQ(c.boxes[1].runs, 0) << "of a single box of 16 no interval is claimed";
      // One scene alone: 10 runs at 95 % leave 4 or fewer outside in 99.99 %.
      EXPECT_GE(c.pixels.covered, 6) << c.batches << " batches";
    }
    runs += result.stop.runs;
    kept += result.stop.kept;
    medians.push_back(result.stop.median_samples);
  }
  for (const auto& [batches, c] : by_batches) {
    EXPECT_GE(c.covered, 50) << batches << " batches, of " << c.runs;
    EXPECT_EQ(c.runs, 6 * kRuns);
  }
  for (const auto& [batches, c] : boxes_by_batches) {
    EXPECT_GE(c.covered, 50) << batches << " batches, boxes of 4";
    EXPECT_EQ(c.runs, 6 * kRuns);
  }
  EXPECT_GE(kept, 50) << "of " << runs;
  // The caustic takes more: its error is known to half its size only.
  std::sort(medians.begin(), medians.end());
  EXPECT_LE(medians[medians.size() / 2], 1.5);
}

}  // namespace
}  // namespace lightmill::test
