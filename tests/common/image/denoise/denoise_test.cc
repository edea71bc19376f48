// The denoiser on pictures whose truth and noise are known.
#include "common/image/denoise/denoise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "tests/common/image/denoise/noisy_picture.h"

namespace lightmill::testing {
namespace {

DenoiseResult denoised(const NoisyPicture& picture, int threads = 1) {
  return denoise_picture(picture.input, {threads});
}

void expect_finite(const DenoiseResult& result) {
  for (const std::vector<float>& channel : result.colour) {
    for (const float x : channel) ASSERT_TRUE(std::isfinite(x));
  }
  for (const float x : result.squared_error) ASSERT_TRUE(std::isfinite(x));
}

TEST(Denoise, MostNoiseGoesAndTextureAndShadowStay) {
  for (const double noise : {0.1, 0.5, 1.5}) {
    const NoisyPicture picture = noisy_room(120, 90, noise);
    const double raw = picture.relmse(picture.input.colour), after = picture.relmse(denoised(picture).colour);
    EXPECT_LT(after, raw / 8) << noise;
  }
}

TEST(Denoise, TheErrorItTellsIsTheTrueOne) {
  for (const double noise : {0.1, 0.5}) {
    const NoisyPicture picture = noisy_room(160, 120, noise);
    const DenoiseResult result = denoised(picture);
    EXPECT_NEAR(result.relmse_raw / picture.relmse(picture.input.colour), 1, 0.1) << noise;
    EXPECT_NEAR(result.relmse / picture.relmse(result.colour), 1, 0.5) << noise;
  }
}

TEST(Denoise, NoiseThatNeighboursShareIsNotTakenForDetail) {
  const NoisyPicture picture = noisy_room(160, 120, 0.4, 4);
  EXPECT_LT(picture.relmse(denoised(picture).colour), picture.relmse(picture.input.colour) / 2);
}

TEST(Denoise, WhatHasNoNoiseStays) {
  const NoisyPicture picture = noisy_room(64, 48, 0);
  EXPECT_LT(picture.relmse(denoised(picture).colour), 1e-10);
}

TEST(Denoise, DetailThatNoFeatureShowsIsNoWorseThanBefore) {
  NoisyPicture picture;
  paint_room(120, 90, &picture);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> level(0.5f, 1);
  for (std::vector<float>& channel : picture.truth) {
    for (float& x : channel) x = level(random);
  }
  for (const double noise : {0.01, 0.1, 0.5}) {
    add_noise(noise, 1, 4, &picture);
    EXPECT_LT(picture.relmse(denoised(picture).colour), 1.02 * picture.relmse(picture.input.colour)) << noise;
  }
}

TEST(Denoise, FirefliesGoAndLampsStay) {
  NoisyPicture picture = noisy_room(60, 40, 0.2);
  const size_t firefly = 20 * 60 + 15, lamp = 10 * 60 + 40;
  for (size_t c = 0; c < 3; ++c) {
    picture.input.colour[c][firefly] += 500;
    picture.input.difference[c][firefly] += 500;
    picture.truth[c][lamp] = picture.input.colour[c][lamp] = 1000;
    picture.input.difference[c][lamp] = 10;
  }
  const DenoiseResult result = denoised(picture);
  EXPECT_NEAR(result.colour[0][firefly], picture.truth[0][firefly], 0.3);
  EXPECT_NEAR(result.colour[0][firefly + 1], picture.truth[0][firefly + 1], 0.2);
  EXPECT_NEAR(result.colour[0][lamp], 1000, 100);
  EXPECT_NEAR(result.colour[0][lamp + 2], picture.truth[0][lamp + 2], 0.2);
}

TEST(Denoise, PixelsWithoutANumberTakeThatOfOthers) {
  NoisyPicture picture = noisy_room(60, 40, 0.2);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                  kInf = std::numeric_limits<float>::infinity();
  picture.input.colour[0][500] = kNan;
  picture.input.colour[1][900] = kInf;
  picture.input.difference[2][1300] = -kInf;
  picture.input.albedo[0].values[800] = kNan;
  picture.input.normal[1].values[801] = kInf;
  picture.input.depth.values[802] = kNan;
  picture.input.depth.values[803] = -1;
  picture.input.colour[2][70] = 3e38f;
  const DenoiseResult result = denoised(picture);
  expect_finite(result);
  EXPECT_NEAR(result.colour[0][500], picture.truth[0][500], 0.3);
  EXPECT_NEAR(result.colour[1][900], picture.truth[1][900], 0.3);
}

TEST(Denoise, SizesAsTheyCome) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 50}, {50, 1}, {2, 3}, {17, 16}}) {
    const NoisyPicture picture = noisy_room(width, height, 0.2);
    const DenoiseResult result = denoised(picture);
    expect_finite(result);
    EXPECT_LT(picture.relmse(result.colour), 2 * picture.relmse(picture.input.colour) + 1e-6);
  }
  NoisyPicture picture = noisy_room(8, 8, 0.2);
  picture.input.albedo[1].values.resize(63);
  EXPECT_THROW(denoised(picture), std::invalid_argument);
}

TEST(Denoise, AnyNumberOfThreadsGivesTheSameBits) {
  const NoisyPicture picture = noisy_room(130, 110, 0.5);
  const DenoiseResult one = denoised(picture, 1), three = denoised(picture, 3);
  EXPECT_EQ(one.colour, three.colour);
  EXPECT_EQ(one.squared_error, three.squared_error);
  EXPECT_EQ(one.relmse, three.relmse);
}

TEST(Denoise, StopsWhereItIsAskedTo) {
  std::stop_source stop;
  stop.request_stop();
  EXPECT_THROW(denoise_picture(noisy_room(40, 30, 0.3).input, {.threads = 2, .stop = stop.get_token()}),
               DenoiseStopped);
}

TEST(Denoise, WithoutHalvesTheNoiseIsGuessed) {
  NoisyPicture picture = noisy_room(120, 90, 0.3);
  for (std::vector<float>& plane : picture.input.difference) plane.clear();
  const DenoiseResult result = denoised(picture);
  EXPECT_LT(picture.relmse(result.colour), picture.relmse(picture.input.colour) / 4);
}

TEST(Denoise, WithoutFeaturesTheColourAloneGuides) {
  NoisyPicture picture = noisy_room(120, 90, 0.3);
  picture.input.albedo = {}, picture.input.normal = {}, picture.input.depth = {};
  const DenoiseResult result = denoised(picture);
  EXPECT_LT(picture.relmse(result.colour), picture.relmse(picture.input.colour) / 2);
}

}  // namespace
}  // namespace lightmill::testing
