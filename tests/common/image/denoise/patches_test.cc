// Means over patches, of pictures that no feature tells anything of.
#include "common/image/denoise/patches.h"

#include <gtest/gtest.h>

#include <random>

namespace lightmill::testing {
namespace {

using denoise::Extent;
using denoise::Features;
using denoise::Halves;
using denoise::patch_means;
using denoise::PatchOptions;

constexpr Extent kExtent{48, 40};

Features no_features() {
  Features features;
  for (auto& half : features.of) {
    for (denoise::Plane& plane : half) plane.assign(kExtent.pixels(), 0.0f);
  }
  for (denoise::Plane& plane : features.variance) plane.assign(kExtent.pixels(), 0.0f);
  return features;
}

/// Dark on the left, bright from `edge` on.
float step(size_t pixel, int edge) {
  return static_cast<int>(pixel % static_cast<size_t>(kExtent.width)) < edge ? 1.0f : 2.0f;
}

Halves noisy_step(int edge, float noise) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal(0, noise);
  Halves halves(kExtent.pixels());
  for (auto& half : halves.of) {
    for (auto& plane : half.c) {
      for (size_t i = 0; i < plane.size(); ++i) plane[i] = step(i, edge) + (noise > 0 ? normal(random) : 0);
    }
  }
  return halves;
}

double mean_square(const Halves& halves, int edge) {
  double sum = 0;
  for (const auto& half : halves.of) {
    for (const auto& plane : half.c) {
      for (size_t i = 0; i < plane.size(); ++i) {
        const double d = double{plane[i]} - double{step(i, edge)};
        sum += d * d;
      }
    }
  }
  return sum / (6 * static_cast<double>(kExtent.pixels()));
}

TEST(Patches, NoiseGoesAndAnEdgeStays) {
  constexpr float kNoise = 0.2f;  // a fifth of the step
  for (const int edge : {0, 24}) {
    const Halves noisy = noisy_step(edge, kNoise);
    for (const int radius : {1, 3}) {
      const PatchOptions options{.patch_radius = radius, .noise = 1};
      const Halves clean = patch_means(kExtent, no_features(), noisy, noisy, options, {.threads = 1});
      EXPECT_LT(mean_square(clean, edge), kNoise * kNoise / 10) << edge << " " << radius;
    }
  }
}

TEST(Patches, OfAGuideWithoutNoiseOnlyItsLikeAreMeant) {
  const Halves noisy = noisy_step(24, 0.5f), guide = noisy_step(24, 0);
  const PatchOptions options{.patch_radius = 0};
  const Halves clean = patch_means(kExtent, no_features(), noisy, guide, options, {.threads = 1});
  // A mean of up to 121 pixels, of half as many beside the edge.
  EXPECT_LT(mean_square(clean, 24), 0.25 / 60);
}

TEST(Patches, FeaturesKeepApartWhatLooksAlike) {
  Features features = no_features();
  for (auto& half : features.of) {
    for (size_t i = 0; i < kExtent.pixels(); ++i) half[0][i] = 4 * step(i, 24);
  }
  const Halves noisy = noisy_step(24, 1.5f);  // more than the step
  const Halves without = patch_means(kExtent, no_features(), noisy, noisy, {.noise = 3}, {.threads = 1});
  const Halves with = patch_means(kExtent, features, noisy, noisy, {.noise = 3}, {.threads = 1});
  EXPECT_LT(mean_square(with, 24), 0.8 * mean_square(without, 24));
}

TEST(Patches, EachHalfIsMadeOfItsOwnValues) {
  Halves noisy = noisy_step(24, 0.2f);
  const Halves guide = noisy;
  const Halves before = patch_means(kExtent, no_features(), noisy, guide, {}, {.threads = 2});
  for (float& x : noisy.of[1].c[0]) x += 1;
  const Halves after = patch_means(kExtent, no_features(), noisy, guide, {}, {.threads = 1});
  EXPECT_EQ(before.of[0].c[0], after.of[0].c[0]);
  EXPECT_NE(before.of[1].c[0], after.of[1].c[0]);
  EXPECT_EQ(before.of[1].c[1], after.of[1].c[1]);
}

}  // namespace
}  // namespace lightmill::testing
