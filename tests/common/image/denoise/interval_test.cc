// The interval of what is left of a picture's error, on pictures whose truth is known.
#include <gtest/gtest.h>

#include <cmath>

#include "common/image/denoise/denoise.h"
#include "tests/common/image/denoise/noisy_picture.h"

namespace lightmill::testing {
namespace {

constexpr int kSeeds = 40;

DenoiseResult with_interval(const NoisyPicture& picture) {
  return denoise_picture(picture.input, {.threads = 2, .interval = true});
}

struct Coverage {
  int inside = 0;
  double truth = 0, estimate = 0;  // means

  void add(const NoisyPicture& picture) {
    const DenoiseResult result = with_interval(picture);
    const double t = picture.relmse(result.colour);
    truth += t / kSeeds, estimate += result.relmse / kSeeds;
    inside += result.relmse_low.value() <= t && t <= result.relmse_high.value() ? 1 : 0;
  }
};

/// Light that few samples find: exponential, in a share `rarity` of the pixels of each half.
void add_rare_light(double rarity, double size, unsigned seed, NoisyPicture* picture) {
  add_noise(0.1, 1, seed, picture);
  std::mt19937 random(seed + 1000);
  std::uniform_real_distribution<double> uniform;
  for (size_t i = 0; i < picture->pixels(); ++i) {
    double light[2];
    for (double& x : light)
      x = (uniform(random) < rarity ? -std::log(1 - uniform(random)) * size / rarity : 0) - size;
    for (size_t c = 0; c < 3; ++c) {
      const double of = 0.3 * static_cast<double>(picture->truth[c][i]);
      picture->input.colour[c][i] += static_cast<float>(of * (light[0] + light[1]) / 2);
      picture->input.difference[c][i] += static_cast<float>(of * (light[0] - light[1]) / 2);
    }
  }
}

// Of 40 at 95 %, 35 and more are inside with a probability of 0.986.
TEST(DenoisedInterval, HoldsTheErrorOfWhiteNoise) {
  for (const double noise : {0.05, 0.5}) {
    Coverage coverage;
    for (unsigned seed = 1; seed <= kSeeds; ++seed) coverage.add(noisy_room(128, 96, noise, 1, seed));
    EXPECT_GE(coverage.inside, 35) << noise;
    // The probe finds up to twice what there is: pixels that are left out change the filters around, too.
    EXPECT_GE(coverage.estimate / coverage.truth, 0.85) << noise;
    EXPECT_LE(coverage.estimate / coverage.truth, 1.9) << noise;
  }
}

// What a half knows of the other is measured by the probe, or the estimate would be 0.7 of the truth and
// less.
TEST(DenoisedInterval, HoldsTheErrorOfNoiseThatNeighboursShare) {
  Coverage coverage;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) coverage.add(noisy_room(128, 96, 0.3, 2, seed));
  EXPECT_GE(coverage.inside, 34);
}

TEST(DenoisedInterval, HoldsTheErrorOfRareLight) {
  Coverage coverage;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    NoisyPicture picture;
    paint_room(128, 96, &picture);
    add_rare_light(0.05, 0.1, seed, &picture);
    coverage.add(picture);
  }
  EXPECT_GE(coverage.inside, 34);
}

TEST(DenoisedInterval, ThePictureIsTheSameAndTheBitsToo) {
  const NoisyPicture picture = noisy_room(130, 110, 0.5);
  const DenoiseResult one = with_interval(picture), again = with_interval(picture),
                      without = denoise_picture(picture.input, {.threads = 1});
  EXPECT_EQ(one.colour, without.colour);
  EXPECT_FALSE(without.relmse_low || without.relmse_high);
  EXPECT_EQ(one.relmse_low, again.relmse_low);
  EXPECT_EQ(one.relmse_high, again.relmse_high);
  EXPECT_LE(one.relmse_low.value(), one.relmse);
  EXPECT_GE(one.relmse_high.value(), one.relmse);
}

TEST(DenoisedInterval, NoneWhereNothingIsKnown) {
  EXPECT_FALSE(with_interval(noisy_room(48, 48, 0.2)).relmse_high) << "nine boxes";
  EXPECT_TRUE(with_interval(noisy_room(64, 64, 0.2)).relmse_high) << "sixteen boxes";
  NoisyPicture guessed = noisy_room(96, 96, 0.2);
  for (std::vector<float>& plane : guessed.input.difference) plane.clear();
  EXPECT_FALSE(with_interval(guessed).relmse_high) << "no halves";
  NoisyPicture rare;
  paint_room(128, 96, &rare);
  add_rare_light(0.002, 0.3, 1, &rare);
  EXPECT_FALSE(with_interval(rare).relmse_high) << "a few fireflies";
}

}  // namespace
}  // namespace lightmill::testing
