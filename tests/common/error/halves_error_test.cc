// The error of a picture from two halves of its samples, where the truth is known.
#include "common/error/halves_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "common/error/metrics.h"

namespace lightmill {
namespace {

struct Halves {
  Image truth, image, difference;
  explicit Halves(int side) : truth(side, side), image(side, side), difference(side, side) {}
};

/// Each half is the truth times a number of mean 1. `rare`: 0 but for one time in so many.
Halves noisy_halves(int side, double noise, int rare, unsigned seed) {
  Halves h(side);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_int_distribution<int> pick(1, std::max(rare, 1));
  for (size_t i = 0; i < h.truth.data.size(); ++i) {
    const double truth = 0.05 + 0.9 * static_cast<double>(i / 3 % static_cast<size_t>(side)) / side;
    const auto half = [&] {
      if (rare > 0) return pick(random) == 1 ? truth * rare : 0;
      return truth * (1 + noise * normal(random));
    };
    const double a = half(), b = half();
    h.truth.data[i] = static_cast<float>(truth);
    h.image.data[i] = static_cast<float>((a + b) / 2);
    h.difference.data[i] = static_cast<float>((a - b) / 2);
  }
  return h;
}

TEST(HalvesError, IsTheTrueOneWithinAFewPercent) {
  for (const double noise : {0.01, 0.1, 0.4, 1.0}) {
    const Halves h = noisy_halves(128, noise, 0, 7);
    const double truth = compare_images(h.image, h.truth).relmse;
    EXPECT_NEAR(relmse_of_halves(h.image, h.difference) / truth, 1, noise < 0.5 ? 0.08 : 0.25) << noise;
  }
}

// A pixel that a rare event is in must not be judged by its own brightness.
TEST(HalvesError, RareLightIsNotHiddenByItself) {
  const Halves h = noisy_halves(128, 0, 20, 7);
  const double truth = compare_images(h.image, h.truth).relmse;
  EXPECT_NEAR(relmse_of_halves(h.image, h.difference) / truth, 1, 0.5);
}

TEST(HalvesError, PixelsWithoutANumberAreLeftOut) {
  Halves h = noisy_halves(64, 0.1, 0, 3);
  const double before = relmse_of_halves(h.image, h.difference);
  h.image.data[300] = std::numeric_limits<float>::quiet_NaN();
  h.difference.data[900] = -std::numeric_limits<float>::infinity();
  EXPECT_NEAR(relmse_of_halves(h.image, h.difference) / before, 1, 0.02);
  for (float& x : h.image.data) x = std::numeric_limits<float>::infinity();
  EXPECT_EQ(relmse_of_halves(h.image, h.difference), 0);
}

TEST(HalvesError, OnePixelIsEnough) {
  Image image(1, 1), difference(1, 1);
  image.data = {1, 1, 1};
  difference.data = {0.01f, 0.01f, 0.01f};
  EXPECT_NEAR(relmse_of_halves(image, difference), 1e-4 / 1.01, 1e-6);
  EXPECT_THROW(relmse_of_halves(image, Image(2, 1)), std::invalid_argument);
}

}  // namespace
}  // namespace lightmill
