#include "common/error/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/base/error.h"
#include "common/error/flip.h"

namespace lightmill {
namespace {

Image constant(int width, int height, float r, float g, float b) {
  Image image(width, height);
  for (size_t i = 0; i < image.data.size(); i += 3) {
    image.data[i] = r;
    image.data[i + 1] = g;
    image.data[i + 2] = b;
  }
  return image;
}

Image noisy(int width, int height, float level, float noise, unsigned seed) {
  std::mt19937 rng(seed);
  std::normal_distribution<float> n;
  Image image(width, height);
  for (float& v : image.data) v = std::max(0.0f, level + noise * n(rng));
  return image;
}

TEST(Metrics, MatchHandComputedNumbers) {
  Image image(2, 1), reference(2, 1);
  image.data = {1, 2, 3, 0, 0, 0.5f};
  reference.data = {1, 1, 1, 0, 0.5f, 0.5f};
  const Metrics m = compare_images(image, reference);
  EXPECT_NEAR(m.mse, (1 + 4 + 0.25) / 6, 1e-12);
  EXPECT_NEAR(m.mae, (1 + 2 + 0.5) / 6, 1e-12);
  EXPECT_NEAR(m.relmse, (1 / 1.01 + 4 / 1.01 + 0.25 / 0.26) / 6, 1e-12);
  EXPECT_NEAR(m.relmse_trimmed, m.relmse, 1e-12);  // 0.1 % of two pixels is none
  EXPECT_NEAR(m.mean_ratio, 6.5 / 4, 1e-12);
}

TEST(Metrics, IdenticalImagesHaveNoError) {
  const Image image = noisy(40, 30, 0.5f, 0.2f, 1);
  const Metrics m = compare_images(image, image);
  EXPECT_EQ(m.mse, 0);
  EXPECT_EQ(m.relmse, 0);
  EXPECT_EQ(m.relmse_trimmed, 0);
  EXPECT_EQ(m.mae, 0);
  EXPECT_EQ(m.flip, 0);
  EXPECT_EQ(m.mean_ratio, 1);
  EXPECT_EQ(compare_images(constant(4, 4, 0, 0, 0), constant(4, 4, 0, 0, 0)).mean_ratio, 1);
}

TEST(Metrics, TrimmingDropsExactlyTheWorstPixels) {
  const Image reference = constant(50, 40, 1, 1, 1);  // 2000 pixels: two are dropped
  Image image = constant(50, 40, 1.1f, 1, 1);
  image.pixel(7, 9)[0] = 1000;
  image.pixel(8, 9)[2] = 500;
  const Metrics m = compare_images(image, reference);
  const double usual = 0.1 * 0.1 / 1.01 / 3;
  EXPECT_NEAR(m.relmse_trimmed, usual, 1e-6);
  EXPECT_GT(m.relmse, 100);
  image.pixel(9, 9)[1] = 11;  // a third one stays
  EXPECT_NEAR(compare_images(image, reference).relmse_trimmed, usual + 100 / 1.01 / 3 / 1998, 1e-4);
}

TEST(Metrics, BoxesOfACheckerboardHaveNoError) {
  // The errors of a box add up to nothing, those of a pixel are all the same.
  Image image(40, 33);
  for (int y = 0; y < 33; ++y) {
    for (int x = 0; x < 40; ++x) {
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = (x + y) % 2 ? 1.25f : 0.75f;
    }
  }
  const Metrics m = compare_images(image, constant(40, 33, 1, 1, 1));
  EXPECT_NEAR(m.relmse, 0.0625 / 1.01, 1e-12);
  for (const auto& boxes : m.relmse_of_boxes) EXPECT_EQ(boxes, 0);
}

TEST(Metrics, BoxesMatchHandComputedNumbers) {
  const Image reference = constant(37, 40, 1, 0.5f, 0);
  Image image = reference;
  // The first box of each side is off by 1 in all; what lies right of 36 columns is in no box.
  image.pixel(3, 3)[0] += 1;
  image.pixel(36, 0)[0] = 1000;
  const Metrics m = compare_images(image, reference);
  const double boxes[] = {9.0 * 10, 2.0 * 2, 1};
  for (size_t i = 0; i < kBoxSides.size(); ++i) {
    const double pixels = kBoxSides[i] * kBoxSides[i];
    ASSERT_TRUE(m.relmse_of_boxes[i]);
    EXPECT_NEAR(*m.relmse_of_boxes[i], 1 / (pixels * pixels) / 1.01 / (3 * boxes[i]) * pixels, 1e-9) << i;
  }
}

TEST(Metrics, ErrorOfWholeBoxesGrowsWithTheBox) {
  // A constant offset is the same at every scale before it is multiplied by the pixels of a box.
  const Metrics m = compare_images(constant(32, 32, 1.5f, 1.5f, 1.5f), constant(32, 32, 1, 1, 1));
  for (size_t i = 0; i < kBoxSides.size(); ++i)
    EXPECT_NEAR(*m.relmse_of_boxes[i], m.relmse * kBoxSides[i] * kBoxSides[i], 1e-9);
}

TEST(Metrics, WhiteNoiseHasTheSameErrorAtEveryScale) {
  const Metrics m = compare_images(noisy(512, 512, 1, 0.1f, 3), constant(512, 512, 1, 1, 1));
  // 3 * 16^2 boxes at 32 pixels: the mean of as many squares is known to 5 %.
  for (const auto& boxes : m.relmse_of_boxes) EXPECT_NEAR(*boxes / m.relmse, 1, 0.15);
}

TEST(Metrics, BoxesThatDoNotFitHaveNoError) {
  const Metrics m = compare_images(constant(40, 15, 1, 1, 1), constant(40, 15, 1, 1, 1));
  EXPECT_EQ(m.relmse_of_boxes[0], 0);
  EXPECT_EQ(m.relmse_of_boxes[1], std::nullopt);
  EXPECT_EQ(m.relmse_of_boxes[2], std::nullopt);
}

TEST(Metrics, RefusesOtherSizesAndNonFiniteValues) {
  const Image image = constant(4, 4, 1, 1, 1);
  try {
    compare_images(image, constant(4, 5, 1, 1, 1));
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kUsage);
  }
  Image bad = image;
  bad.pixel(2, 1)[1] = std::numeric_limits<float>::infinity();
  try {
    compare_images(bad, image);
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::kFailed);
    EXPECT_NE(std::string(e.what()).find("(2, 1)"), std::string::npos);
  }
  EXPECT_THROW(compare_images(Image(), Image()), Error);
  EXPECT_THROW(check_comparable(bad, "reference"), Error);
  EXPECT_NO_THROW(check_comparable(image, "reference"));
}

TEST(Flip, BlackAgainstWhiteByHand) {
  // Flat images have no features. HyAB = 100 (lightness alone); the largest is green to blue.
  const double white = std::pow(100.0, 0.7);
  const double green_l = 87.7370, green_a = -86.1846 * 0.877370, green_b = 83.1812 * 0.877370;
  const double blue_l = 32.3026, blue_a = 79.1967 * 0.323026, blue_b = -107.8637 * 0.323026;
  const double most = std::pow(green_l - blue_l + std::hypot(green_a - blue_a, green_b - blue_b), 0.7);
  const double expected = 0.95 + (white - 0.4 * most) / (0.6 * most) * 0.05;
  EXPECT_NEAR(flip_mean(constant(24, 24, 0, 0, 0), constant(24, 24, 1, 1, 1)), expected, 1e-3);
  EXPECT_GT(expected, 0.96);
  EXPECT_NEAR(flip_mean(constant(24, 24, 0, 1, 0), constant(24, 24, 0, 0, 1)), 1, 1e-5);
}

TEST(Flip, SmallDifferencesAreSmallAndOrderDoesNotMatter) {
  const Image a = noisy(48, 40, 0.4f, 0.0f, 1);
  const Image slightly = noisy(48, 40, 0.4f, 0.004f, 2);
  const Image much = noisy(48, 40, 0.4f, 0.2f, 2);
  const double small = flip_mean(slightly, a), large = flip_mean(much, a);
  EXPECT_GT(small, 0);
  EXPECT_LT(small, 0.06);
  EXPECT_GT(large, 2 * small);
  EXPECT_LT(large, 1);
  EXPECT_NEAR(flip_mean(a, much), large, 1e-6);
}

TEST(Flip, ValuesAboveTheDisplaysWhiteLookAlike) {
  EXPECT_EQ(flip_mean(constant(16, 16, 3, 4, 5), constant(16, 16, 1, 1, 1)), 0);
}

TEST(Flip, FinePatternsMelt) {
  // A one-pixel checkerboard at 67 pixels per degree against its mean: much of the contrast is filtered away,
  // while coarse stripes of the same contrast are plain to see.
  Image fine(64, 64), coarse(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      for (int c = 0; c < 3; ++c) {
        fine.pixel(x, y)[c] = (x + y) % 2 ? 0.6f : 0.4f;
        coarse.pixel(x, y)[c] = (x / 16) % 2 ? 0.6f : 0.4f;
      }
    }
  }
  const Image gray = constant(64, 64, 0.5f, 0.5f, 0.5f);
  EXPECT_LT(flip_mean(fine, gray), 0.6 * flip_mean(coarse, gray));
}

TEST(Flip, OnePixelImagesWork) {
  EXPECT_EQ(flip_mean(constant(1, 1, 0.5f, 0.5f, 0.5f), constant(1, 1, 0.5f, 0.5f, 0.5f)), 0);
  EXPECT_GT(flip_mean(constant(1, 300, 0, 0, 0), constant(1, 300, 1, 1, 1)), 0.9);
}

}  // namespace
}  // namespace lightmill
