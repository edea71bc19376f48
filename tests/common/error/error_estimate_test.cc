#include "common/error/error_estimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace lightmill {
namespace {

struct Batches {
  size_t width, rows;
  std::vector<std::vector<float>> sums;

  BatchError error() const {
    std::vector<const float*> pointers;
    for (const auto& sum : sums) pointers.push_back(sum.data());
    std::vector<int> replicates;
    for (size_t b = 0; b < sums.size(); ++b) replicates.push_back(static_cast<int>(b % 2));
    return estimate_batch_error(pointers, replicates, {width, rows}, 16);
  }

  Batches transposed() const {
    Batches result{rows, width, {}};
    for (const auto& sum : sums) {
      auto& to = result.sums.emplace_back(sum.size());
      for (size_t y = 0; y < rows; ++y) {
        for (size_t x = 0; x < width; ++x) {
          for (size_t c = 0; c < 3; ++c) to[3 * (x * rows + y) + c] = sum[3 * (y * width + x) + c];
        }
      }
    }
    return result;
  }
};

/// Light in rare events, so that what is around a pixel decides its weight.
Batches rare_events(size_t width, size_t rows, size_t count) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<float> uniform;
  Batches batches{width, rows, {}};
  for (size_t b = 0; b < count; ++b) {
    auto& sum = batches.sums.emplace_back(3 * width * rows);
    for (float& value : sum) value = uniform(rng) < 0.1f ? 16 * uniform(rng) : 0.2f * uniform(rng);
  }
  return batches;
}

// The image is worked through in bands of rows; what is around a pixel must not end with its band. 20 rows
// are one band, 300 are ten.
TEST(ErrorEstimate, TheTransposedImageHasTheSameError) {
  for (const size_t count : {2u, 3u, 5u, 17u}) {
    const Batches batches = rare_events(300, 20, count);
    const BatchError error = batches.error(), transposed = batches.transposed().error();
    EXPECT_NEAR(transposed.relmse, error.relmse, 1e-7 * error.relmse) << count;
    ASSERT_EQ(transposed.interval.has_value(), error.interval.has_value()) << count;
    if (error.interval) {
      EXPECT_NEAR(transposed.interval->low, error.interval->low, 1e-5 * error.relmse) << count;
      EXPECT_NEAR(transposed.interval->high, error.interval->high, 1e-5 * error.interval->high) << count;
    }
  }
}

}  // namespace
}  // namespace lightmill
