#include "worker/render/plan/neyman_allocation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lightmill::test {
namespace {

constexpr int kSide = 16;
const RegionGrid kGrid{8, 0, 0, kSide, kSide};

std::vector<RegionNoise> even(double variance, double cost) {
  std::vector<RegionNoise> regions;
  for (int i = 0; i < kSide * kSide; ++i)
    regions.push_back(
        {.pixels = 64, .paths = {64, 64}, .camera = {variance, variance}, .splat = 0, .cost = cost});
  return regions;
}

double mean_samples(const SampleAllocation& map) {
  double sum = 0;
  for (int64_t i = 0; i < kGrid.count(); ++i) sum += std::exp2(map.level(i));
  return sum / static_cast<double>(kGrid.count());
}

TEST(AllocateSamples, GoesWhereTheNoiseIs) {
  auto regions = even(0.01, 1);
  // A disc of a hundred times the variance.
  const auto noisy = [](int i) { return std::hypot(i % kSide - 8, i / kSide - 8) < 4; };
  for (int i = 0; i < kSide * kSide; ++i) {
    if (noisy(i)) regions[static_cast<size_t>(i)].camera[0] = regions[static_cast<size_t>(i)].camera[1] = 1;
  }
  const AllocationChoice choice = allocate_samples(kGrid, regions, 0);
  ASSERT_FALSE(choice.map.uniform());
  // Neyman: mean(V) / mean(sqrt V)^2 = 2.4 here; powers of two, bounds and smoothing cost some of it.
  EXPECT_GT(choice.gain, 1.8);
  EXPECT_LT(choice.gain, 2.5);
  EXPECT_LE(mean_samples(choice.map), 1);
  EXPECT_GT(mean_samples(choice.map), 0.8);
  for (int i = 0; i < kSide * kSide; ++i) {
    if (noisy(i)) {
      EXPECT_GT(choice.map.level(i), 0) << i;
    }
  }
  EXPECT_LT(choice.map.level(0), 0);
}

TEST(AllocateSamples, DoesNotFollowThePilotsOwnNoise) {
  // Estimates scatter by a factor of three, independently in both halves; the truth is even.
  auto regions = even(1, 1);
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, 1.1);
  for (RegionNoise& r : regions) {
    for (double& v : r.camera) v = std::exp(normal(random));
  }
  EXPECT_TRUE(allocate_samples(kGrid, regions, 0).map.uniform());
}

TEST(AllocateSamples, LeavesSplatsAlone) {
  auto regions = even(0.01, 1);
  for (int i = 0; i < 40; ++i)
    regions[static_cast<size_t>(i)].camera[0] = regions[static_cast<size_t>(i)].camera[1] = 1;
  EXPECT_FALSE(allocate_samples(kGrid, regions, 0).map.uniform());
  for (RegionNoise& r : regions) r.splat = 3;
  EXPECT_TRUE(allocate_samples(kGrid, regions, 0).map.uniform());
}

TEST(AllocateSamples, SavesWhereSamplesAreDear) {
  auto regions = even(1, 1);
  for (size_t i = 0; i < 128; ++i) regions[i].cost = 30;
  const AllocationChoice choice = allocate_samples(kGrid, regions, 0);
  ASSERT_FALSE(choice.map.uniform());
  EXPECT_LT(choice.map.level(0), choice.map.level(255));
}

TEST(AllocateSamples, HasAnAnswerWithoutNoise) {
  EXPECT_TRUE(allocate_samples(kGrid, even(0, 1), 0).map.uniform());
  EXPECT_TRUE(allocate_samples(kGrid, even(1, 0), 0).map.uniform());
  EXPECT_TRUE(allocate_samples(kGrid, std::vector<RegionNoise>(kSide * kSide), 1).map.uniform());
}

}  // namespace
}  // namespace lightmill::test
