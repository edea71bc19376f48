#include "common/error/batch_film.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "common/base/error.h"
#include "common/film/film.h"
#include "common/job/replicates.h"
#include "tests/common/film/test_partials.h"

namespace lightmill {
namespace {

using testing::constant_batch;
using testing::full_grid;
using testing::in_packet_order;
using testing::kQuantum;

/// A synthetic renderer: pixel p has mean `level(p)` and the sum of 16 samples has the standard deviation
/// `noise(p)` per sample * 4; `draw` is a variable of mean 0 and variance 1 with draw > -level * 4 / noise.
struct Synthetic {
  FilmGrid grid = full_grid(48, 40);
  std::function<double(size_t)> level, noise;
  std::function<double(std::mt19937_64&)> draw;
  bool as_splats = false;

  /// relMSE of the mean of `spp` samples.
  double expected_relmse(double spp) const {
    double sum = 0;
    const auto pixels = static_cast<size_t>(grid.crop.area());
    for (size_t p = 0; p < pixels; ++p) sum += noise(p) * noise(p) / spp / (level(p) * level(p) + 1e-2);
    return sum / static_cast<double>(pixels);
  }

  Partial superblock(int64_t index, std::mt19937_64& rng) const {
    Partial p;
    p.grid = grid;
    p.tile = {grid.cells(), 16 * index, 16 * (index + 1)};
    p.quantum_exponent = kQuantum;
    const auto pixels = static_cast<size_t>(grid.crop.area());
    for (size_t i = 0; i < pixels; ++i) {
      ExactRgb sum;
      for (Units& c : sum.c) {
        const double value = 16 * level(i) + 4 * noise(i) * draw(rng);
        c = to_units(static_cast<float>(std::max(0.0, value)), kQuantum).value();
      }
      if (as_splats) {
        p.splats.push_back({static_cast<uint32_t>(i), sum});
      } else {
        p.camera.push_back(sum);
      }
    }
    p.camera = as_splats ? p.camera : in_packet_order(grid, p.camera);
    p.light_paths = as_splats ? 16 * pixels : 0;
    return p;
  }
};

double level_ramp(size_t p) { return 0.05 + 0.01 * static_cast<double>(p % 100); }

Synthetic gaussian(double relative_noise) {
  Synthetic s;
  s.level = level_ramp;
  s.noise = [relative_noise](size_t p) { return relative_noise * level_ramp(p); };
  s.draw = [](std::mt19937_64& rng) { return std::normal_distribution<double>()(rng); };
  return s;
}

/// Heavy tails: the sum of a superblock is log-normal with the right mean and variance.
Synthetic log_normal(double sigma) {
  Synthetic s;
  s.level = level_ramp;
  const double relative = std::sqrt(std::exp(sigma * sigma) - 1);  // of a superblock's mean
  s.noise = [relative](size_t p) { return 4 * relative * level_ramp(p); };
  s.draw = [sigma, relative](std::mt19937_64& rng) {
    const double z = std::normal_distribution<double>()(rng);
    return (std::exp(sigma * z - sigma * sigma / 2) - 1) / relative;
  };
  return s;
}

/// relMSE of an image of a synthetic renderer against its levels.
double true_relmse(const Synthetic& s, const Image& image) {
  double sum = 0;
  for (size_t i = 0; i < image.data.size(); ++i) {
    const double r = s.level(i / 3), d = static_cast<double>(image.data[i]) - r;
    sum += d * d / (r * r + 1e-2);
  }
  return sum / static_cast<double>(image.data.size());
}

struct Coverage {
  double covered = 0;      // share of trials whose interval holds the error of their own image
  double mean_ratio = 0;   // mean estimate / true value
  double ratio_error = 0;  // standard error of that mean
};

Coverage run_trials(const Synthetic& s, int64_t superblocks, int trials, uint64_t seed) {
  std::mt19937_64 rng(seed);
  const double truth = s.expected_relmse(16.0 * static_cast<double>(superblocks));
  Coverage c;
  double sum = 0, square = 0;
  for (int t = 0; t < trials; ++t) {
    BatchFilm film(s.grid);
    Film image(s.grid);
    for (int64_t b = 0; b < superblocks; ++b) {
      const Partial partial = s.superblock(b, rng);
      film.fold(partial);
      image.fold(partial);
    }
    ErrorPoint p;
    film.estimate(&p);
    const double own = true_relmse(s, image.resolve());
    c.covered += *p.relmse_low <= own && own <= *p.relmse_high ? 1.0 / trials : 0;
    sum += *p.relmse / truth;
    square += *p.relmse / truth * (*p.relmse / truth);
  }
  c.mean_ratio = sum / trials;
  c.ratio_error = std::sqrt(std::max(0.0, square / trials - c.mean_ratio * c.mean_ratio) / trials);
  return c;
}

// 400 trials at 95 %: the binomial standard deviation is 1.09 %; four of them below is 90.6 %.
constexpr int kTrials = 400;
constexpr double kLeastCovered = 0.95 - 4 * 0.0109;

// Neighbouring pixels of these synthetic images have little in common (a ramp that wraps), which is the worst
// case for weights that ask the neighbours.
TEST(BatchFilm, NormalNoiseIsEstimatedWithoutBiasAndCovered) {
  Synthetic s = gaussian(1.0);  // one sample is off by 100 %
  s.grid = full_grid(20, 16);
  for (const int64_t n : {4, 16}) {
    const Coverage c = run_trials(s, n, kTrials, 42);
    EXPECT_NEAR(c.mean_ratio, 1, 4 * c.ratio_error + 0.02) << n;
    EXPECT_GE(c.covered, kLeastCovered) << n;
  }
}

TEST(BatchFilm, HeavyTailsAreEstimatedWithoutBiasAndCovered) {
  Synthetic s = log_normal(0.6);
  s.grid = full_grid(20, 16);
  const Coverage c = run_trials(s, 16, kTrials, 43);
  EXPECT_NEAR(c.mean_ratio, 1, 4 * c.ratio_error + 0.05);
  EXPECT_GE(c.covered, 0.85);
}

TEST(BatchFilm, NoiseSharedByAllPixelsIsCovered) {
  // Correlated pixels: the worst case for an interval. One draw per superblock moves the whole image.
  Synthetic s = gaussian(1.0);
  s.grid = full_grid(8, 4);
  auto count = std::make_shared<int>(0);
  auto common = std::make_shared<double>(0);
  const int values = 3 * 8 * 4;
  s.draw = [count, common, values](std::mt19937_64& rng) {
    if ((*count)++ % values == 0) *common = std::normal_distribution<double>()(rng);
    return *common;
  };
  const Coverage c = run_trials(s, 16, kTrials, 44);
  EXPECT_NEAR(c.mean_ratio, 1, 4 * c.ratio_error + 0.02);
  EXPECT_GE(c.covered, kLeastCovered);
}

TEST(BatchFilm, NoiseInTheDenominatorIsCorrected) {
  // Gamma-distributed superblocks with a standard deviation of 100 % of the mean: plain 1 / (M^2 + e) would
  // be 6 % to 16 % off with 8 batches.
  for (const double level : {0.02, 0.1, 0.5}) {
    Synthetic s;
    s.grid = full_grid(24, 24);
    s.level = [level](size_t) { return level; };
    s.noise = [level](size_t) { return 4 * level; };
    s.draw = [](std::mt19937_64& rng) { return std::exponential_distribution<double>()(rng) - 1; };
    const Coverage c = run_trials(s, 8, 100, 45);
    EXPECT_NEAR(c.mean_ratio, 1, level < 0.3 ? 0.03 : 0.12) << level;
  }
}

TEST(BatchFilm, SplatsCountLikeCameraSamples) {
  Synthetic s = gaussian(0.5);
  std::mt19937_64 a(1), b(1);
  BatchFilm camera(s.grid), light(s.grid);
  for (int64_t i = 0; i < 5; ++i) camera.fold(s.superblock(i, a));
  s.as_splats = true;
  for (int64_t i = 0; i < 5; ++i) light.fold(s.superblock(i, b));
  ErrorPoint p, q;
  camera.estimate(&p);
  light.estimate(&q);
  EXPECT_EQ(p.relmse, q.relmse);
  EXPECT_EQ(p.relmse_low, q.relmse_low);
  EXPECT_EQ(q.batches, 5);
}

TEST(BatchFilm, TheErrorIsThatOfAllSamplesNotOfCompleteBatchesOnly) {
  const Synthetic s = gaussian(0.5);
  std::mt19937_64 rng(1);
  BatchFilm film(s.grid);
  for (int64_t i = 0; i < 4; ++i) film.fold(s.superblock(i, rng));
  ErrorPoint before, after;
  film.estimate(&before);
  Partial half = s.superblock(4, rng);
  half.tile.sample_end -= 8;
  film.fold(half);
  film.estimate(&after);
  EXPECT_EQ(after.batches, 4);
  EXPECT_EQ(film.spp(), 72);
  EXPECT_NEAR(*after.relmse, *before.relmse * 64 / 72, 1e-12);
}

TEST(BatchFilm, AnEstimateTakesTwoBatchesAndItsIntervalFour) {
  const Synthetic s = gaussian(0.5);
  std::mt19937_64 rng(1);
  BatchFilm film(s.grid);
  for (int n = 0; n < 6; ++n) {
    ErrorPoint p;
    p.relmse = p.relmse_low = p.relmse_high = 7;
    film.estimate(&p);
    EXPECT_EQ(p.batches, n);
    EXPECT_EQ(p.relmse.has_value(), n >= 2) << n;
    EXPECT_EQ(p.relmse_low.has_value(), n >= 4) << n;
    EXPECT_EQ(p.relmse_high.has_value(), n >= 4) << n;
    if (p.relmse) {
      EXPECT_NEAR(*p.relmse / s.expected_relmse(16.0 * n), 1, 0.1) << n;
    }
    film.fold(s.superblock(n, rng));
  }
}

TEST(BatchFilm, FirefliesAreJudgedByWhatIsAroundThem) {
  // One superblock of a pixel in 50 holds an event of 50 times the background. Judged by itself, a pixel
  // that has one looks bright and well known.
  Synthetic s;
  s.grid = full_grid(40, 40);
  const double chance = 1.0 / 50, event = 50 * 16 * 0.2;
  s.level = [=](size_t) { return 0.2 + chance * event / 16; };
  s.noise = [=](size_t) { return event * std::sqrt(chance * (1 - chance)) / 4; };
  s.draw = [=](std::mt19937_64& rng) {
    return ((std::uniform_real_distribution<double>()(rng) < chance ? event : 0) - chance * event) /
           (event * std::sqrt(chance * (1 - chance)));
  };
  for (const int64_t n : {4, 8, 16}) {
    const Coverage c = run_trials(s, n, 100, 46);
    EXPECT_NEAR(c.mean_ratio, 1, 0.2) << n;
  }
}

TEST(BatchFilm, SmallBlocksMakeUpTheFirstSuperblock) {
  const FilmGrid grid = full_grid(40, 20);
  BatchFilm film(grid);
  for (int64_t b = 0; b < 5; ++b) {
    for (int cx = 0; cx < 2; ++cx) {
      ErrorPoint p;
      film.estimate(&p);
      EXPECT_EQ(p.batches, 0);
      film.fold(
          testing::random_partial(grid, {{cx, 0, cx + 1, 1}, block_begin(b), block_end(b)}, 1, true, 4));
    }
  }
  ErrorPoint p;
  film.estimate(&p);
  EXPECT_EQ(p.batches, 1);
}

TEST(BatchFilm, BatchesMergeAndNeverExceed32) {
  Synthetic s = gaussian(0.8);
  s.grid = full_grid(16, 16);
  std::mt19937_64 rng(2);
  BatchFilm film(s.grid);
  ErrorPoint p;
  for (int64_t i = 0; i < 200; ++i) {
    film.fold(s.superblock(i, rng));
    film.estimate(&p);
    EXPECT_LE(p.batches, 32);
    EXPECT_GE(p.batches, std::min<int64_t>(i + 1, 16));
  }
  EXPECT_EQ(film.max_tile_superblocks(), 8);
  EXPECT_EQ(p.batches, 25);
  EXPECT_NEAR(*p.relmse / s.expected_relmse(3200), 1, 0.15);
}

TEST(BatchFilm, ATileThatCrossesAGroupMergesBatches) {
  const FilmGrid grid = full_grid(16, 16);
  BatchFilm film(grid);
  for (int64_t k = 0; k < 32; ++k)
    film.fold(testing::random_partial(grid, {{0, 0, 1, 1}, 16 * k, 16 * k + 16}, 1, true, 0));
  ErrorPoint p;
  film.estimate(&p);
  EXPECT_EQ(p.batches, 32);
  EXPECT_EQ(film.max_tile_superblocks(), 1);
  // Superblocks 32 to 35 are of one replicate, and are those from 16 on there.
  film.fold(testing::random_partial(grid, {{0, 0, 1, 1}, 16 * 32, 16 * 36}, 2, true, 0));
  EXPECT_EQ(film.max_tile_superblocks(), 4);
  film.estimate(&p);
  EXPECT_EQ(p.batches, 9);
}

TEST(BatchFilm, ATileOfBothReplicatesIsInNoBatch) {
  const FilmGrid grid = full_grid(16, 16);
  BatchFilm film(grid);
  film.fold(testing::random_partial(grid, {{0, 0, 1, 1}, 0, 32}, 1, true, 0));
  ErrorPoint p;
  film.estimate(&p);
  EXPECT_EQ(p.batches, 0);
  EXPECT_EQ(film.spp(), 32);
  EXPECT_EQ(BatchFilm::restore(film.snapshot()).spp(), 32);
}

// The errors of two superblocks of a replicate cancel in part: the image is better than its batches look.
TEST(BatchFilm, WhatSequencesGainIsSeen) {
  const Synthetic s = gaussian(1.0);
  std::mt19937_64 rng(11);
  BatchFilm film(s.grid);
  Film image(s.grid);
  std::vector<ExactRgb> means(static_cast<size_t>(s.grid.crop.area()));
  for (size_t i = 0; i < means.size(); ++i)
    for (Units& c : means[i].c) c = to_units(static_cast<float>(16 * s.level(i)), kQuantum).value();
  means = in_packet_order(s.grid, means);
  Partial last[kReplicates];
  for (int64_t k = 0; k < 16; ++k) {
    Partial p = s.superblock(k, rng);
    const ReplicateBlock block = replicate_of(k);
    const std::vector<ExactRgb>& before = last[block.replicate].camera;
    for (size_t i = 0; block.superblock % 2 == 1 && i < p.camera.size(); ++i) {
      for (size_t c = 0; c < 3; ++c) {
        const double mean = from_units(means[i].c[c], kQuantum), own = from_units(p.camera[i].c[c], kQuantum);
        const double value = mean + 0.6 * (own - mean) - 0.8 * (from_units(before[i].c[c], kQuantum) - mean);
        p.camera[i].c[c] = to_units(static_cast<float>(std::max(0.0, value)), kQuantum).value();
      }
    }
    last[block.replicate] = p;
    film.fold(p);
    image.fold(p);
  }
  ErrorPoint p;
  film.estimate(&p);
  // The sum of two has (1 - 0.8)^2 + 0.6^2 = 0.4 of the variance of one, instead of 2.
  EXPECT_NEAR(*p.relmse / s.expected_relmse(256), 0.2, 0.03);
  const double own = true_relmse(s, image.resolve());
  EXPECT_LE(*p.relmse_low, own);
  EXPECT_GE(*p.relmse_high, own);
}

TEST(BatchFilm, LargeFilmsFollowASubsetOfThePixels) {
  const FilmGrid grid = full_grid(700, 600);
  BatchFilm film(grid);
  for (const int64_t b : {0, 1}) film.fold(constant_batch(grid, b));
  ErrorPoint p;
  film.estimate(&p);
  BatchFilm small(full_grid(20, 20));
  for (const int64_t b : {0, 1}) small.fold(constant_batch(full_grid(20, 20), b));
  ErrorPoint q;
  small.estimate(&q);
  ASSERT_TRUE(p.relmse);
  EXPECT_NEAR(*p.relmse, *q.relmse, 1e-9 * *q.relmse);
  // All pixels of a batch deviate alike, and so do means of them.
  for (size_t i = 0; i < kBoxSides.size(); ++i) {
    ASSERT_TRUE(p.boxes[i].relmse);
    EXPECT_NEAR(*p.boxes[i].relmse / (*p.relmse * kBoxSides[i] * kBoxSides[i]), 1, 1e-6) << kBoxSides[i];
    EXPECT_EQ(q.boxes[i].relmse.has_value(), kBoxSides[i] <= 20);
  }
  constexpr size_t kBoxes = 43 * 37;
  EXPECT_LT(film.snapshot().size(), 2 * 3 * 4 * (static_cast<size_t>(BatchFilm::kMaxTrackedPixels) + kBoxes));
}

TEST(BatchFilm, SnapshotsRestoreEverything) {
  const Synthetic s = gaussian(0.5);
  std::mt19937_64 rng(1);
  BatchFilm film(s.grid);
  for (int64_t i = 0; i < 40; ++i) film.fold(s.superblock(i, rng));
  BatchFilm back = BatchFilm::restore(film.snapshot());
  EXPECT_EQ(back.snapshot(), film.snapshot());
  const Partial next = s.superblock(40, rng);
  film.fold(next);
  back.fold(next);
  ErrorPoint p, q;
  film.estimate(&p);
  back.estimate(&q);
  EXPECT_EQ(p.relmse, q.relmse);
  EXPECT_EQ(p.batches, q.batches);
  std::string bad = film.snapshot();
  bad[bad.size() / 2] = static_cast<char>(bad[bad.size() / 2] ^ 1);
  EXPECT_THROW(BatchFilm::restore(bad), Error);
  EXPECT_THROW(BatchFilm::restore(""), Error);
  EXPECT_THROW(back.fold(testing::random_partial(full_grid(9, 9), {{0, 0, 1, 1}, 0, 16}, 1, true, 0)), Error);
}

TEST(BatchFilm, TheErrorMapShowsWhereTheNoiseIs) {
  Synthetic s = gaussian(0.2);
  const size_t width = static_cast<size_t>(s.grid.crop.width());
  s.level = [](size_t) { return 0.5; };
  s.noise = [&](size_t p) { return p % width < width / 2 ? 0.1 : 0.4; };
  std::mt19937_64 rng(5);
  BatchFilm film(s.grid);
  EXPECT_TRUE(film.error_map(8).data.empty());
  for (int64_t b = 0; b < 16; ++b) film.fold(s.superblock(b, rng));
  const Image map = film.error_map(8);
  ASSERT_EQ(map.width, 6);
  ASSERT_EQ(map.height, 5);
  ASSERT_EQ(map.channels, 1);
  // 64 pixels x 15 degrees of freedom, the channels alike: a standard error below 5 %.
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      const double noise = x < 3 ? 0.1 : 0.4, expected = noise * noise / 256 / (0.25 + 1e-2);
      EXPECT_NEAR(static_cast<double>(*map.pixel(x, y)), expected, 0.25 * expected) << x << "," << y;
    }
  }
  ErrorPoint point;
  film.estimate(&point);
  double mean = 0;
  for (const float value : map.data)
    mean += static_cast<double>(value) / static_cast<double>(map.data.size());
  EXPECT_NEAR(mean, *point.relmse, 0.1 * *point.relmse);
}

TEST(BatchFilm, TheErrorMapOfALargeFilmHasNoHoles) {
  const FilmGrid grid = full_grid(1001, 777);
  BatchFilm film(grid);
  EXPECT_EQ(film.error_map_block(), 16);
  Partial p;
  p.grid = grid;
  p.quantum_exponent = kQuantum;
  p.camera.assign(static_cast<size_t>(grid.crop.area()), ExactRgb{});
  for (int64_t b = 0; b < 2; ++b) {
    p.tile = {grid.cells(), 16 * b, 16 * (b + 1)};
    film.fold(p);
  }
  const Image map = film.error_map(film.error_map_block());
  EXPECT_EQ(map.width, 63);
  EXPECT_EQ(map.height, 49);
  for (int y = 0; y + 1 < map.height; ++y) {
    for (int x = 0; x + 1 < map.width; ++x) ASSERT_EQ(*map.pixel(x, y), 0) << x << "," << y;
  }
}

}  // namespace
}  // namespace lightmill
