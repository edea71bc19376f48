#pragma once
// Agreement of two estimators of the same image, per channel and 8x8 block, from independent batches.
//
// Every block and channel gives a Welch t-test; the family is corrected by Sidak. The distribution of a
// block's batch means must be near enough to normal: a block whose relative standard error in either image is
// above `max_relative_error` cannot be judged and is excluded. At most `max_excluded` of the blocks may be.
#include "tests/support/render.h"

namespace lightmill::test {

struct AgreementTest {
  double alpha = 1e-4;               // family-wise
  double max_relative_error = 0.10;  // standard error over mean of a block that counts
  double max_excluded = 0.10;        // fraction of blocks
  double rounding = 2e-5;
  bool one_sided = false;  // only a brighter `a` fails
  /// Blocks that count; empty: all.
  std::function<bool(const PixelRect&)> include{};
};

struct Agreement {
  int judged = 0, excluded = 0, failed = 0;
  double worst_p = 1;
  PixelRect worst;
  int worst_channel = 0;
  Estimate worst_a, worst_b;
  /// Median relative half width of the judged blocks at the family's level: what a block could tell.
  double median_resolution = 0;
};
Agreement compare_blocks(const Batches& a, const Batches& b, const AgreementTest& test);
/// All judged blocks agree, and enough blocks are judged.
::testing::AssertionResult images_agree(const Batches& a, const Batches& b, const AgreementTest& test = {});
/// `batches` with every pixel multiplied by `factor`: to show that a comparison can fail.
Batches scaled(const Batches& batches, float factor);

}  // namespace lightmill::test
