#include "worker/render/plan/rare_paths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace lightmill::test {
namespace {

RarePath path(float square, float variance) {
  RarePath p{square, {}};
  p.variance.fill(variance);
  return p;
}

TEST(RarePaths, AreTheOnesWithTheLargestSquaresWhateverTheirOrder) {
  RarePaths rising, falling;
  for (int i = 0; i < 100; ++i) {
    for (const auto& [paths, square] : {std::pair{&rising, i}, std::pair{&falling, 99 - i}}) {
      if (paths->takes(static_cast<float>(square)))
        paths->add(path(static_cast<float>(square), static_cast<float>(2 * square)));
    }
  }
  ASSERT_EQ(rising.paths().size(), RarePaths::kMost);
  for (size_t i = 0; i < RarePaths::kMost; ++i) {
    EXPECT_EQ(rising.paths()[i].square, static_cast<float>(99 - i));
    EXPECT_EQ(falling.paths()[i].square, rising.paths()[i].square);
    EXPECT_EQ(rising.paths()[i].variance[7], 2 * rising.paths()[i].square);
  }
  EXPECT_FALSE(RarePaths().takes(RarePaths::kLeastSquare));
}

TEST(RarePaths, OfManyCellsAreWeighedTogether) {
  RarePaths a, b;
  a.add(path(100, 1));
  b.add(path(1000, 10));
  b.scale(0.5f);
  const double both = unseen_variance({&a, &b})[0];
  EXPECT_NEAR(both / unseen_variance({&a})[0], 6, 1e-9);
  for (int i = 0; i < 20; ++i) b.add(path(2000, 3));
  EXPECT_NEAR(unseen_variance({&a, &b})[0] / unseen_variance({&a})[0], 3.0 * RarePaths::kMost, 1e-9)
      << "no more than those stand for the others";
}

// Squares by Pareto's law of index 1, no larger than a render of 64 times the samples meets: what the samples
// leave out against what is said of it. The largest few decide, so medians are compared.
TEST(RarePaths, TellWhatParetosLawHasBeyondThem) {
  constexpr int kRuns = 101, kSamples = 1 << 14;
  std::vector<double> ratios;
  for (int run = 0; run < kRuns; ++run) {
    std::mt19937_64 random(static_cast<uint64_t>(run));
    std::uniform_real_distribution<double> uniform;
    RarePaths paths;
    for (int i = 0; i < kSamples; ++i) {
      const auto square = static_cast<float>(1 / std::max(uniform(random), 1.0 / (64.0 * kSamples)));
      if (paths.takes(square)) paths.add(path(square, square));
    }
    // Octaves from kSamples to 64 kSamples: ln(2) each, a sample.
    ratios.push_back(unseen_variance({&paths})[0] / (kSamples * 6 * std::log(2.0)));
  }
  std::nth_element(ratios.begin(), ratios.begin() + kRuns / 2, ratios.end());
  EXPECT_GT(ratios[kRuns / 2], 0.5);
  EXPECT_LT(ratios[kRuns / 2], 2);
}

}  // namespace
}  // namespace lightmill::test
