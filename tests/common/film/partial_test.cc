#include "common/film/partial.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <thread>

#include "tests/common/film/test_partials.h"

namespace lightmill {
namespace {

using testing::kQuantum;

struct Work {
  int cx = 0, cy = 0;
  std::vector<ExactRgb> sums;
  std::vector<Splat> splats;
};

std::vector<Work> make_work(const FilmGrid& grid, const CellRect& cells, int blocks) {
  std::mt19937_64 rng(3);
  std::uniform_real_distribution<float> value(0, 2);
  std::vector<Work> all;
  for (int block = 0; block < blocks; ++block) {
    for (int cy = cells.y0; cy < cells.y1; ++cy) {
      for (int cx = cells.x0; cx < cells.x1; ++cx) {
        Work w{cx, cy, std::vector<ExactRgb>(kCellPixels), {}};
        for (ExactRgb& sum : w.sums) sum = testing::random_sum(rng, 40);
        for (int i = 0; i < 700; ++i) {
          const auto pixel = static_cast<uint32_t>(rng() % static_cast<uint64_t>(grid.width * grid.height));
          w.splats.push_back({pixel, value(rng), value(rng), value(rng)});
        }
        all.push_back(std::move(w));
      }
    }
  }
  return all;
}

void add(const Work& w, PartialBuilder* builder) {
  builder->add_camera(w.cx, w.cy, std::span<const ExactRgb, kCellPixels>(w.sums));
  builder->add_splats(w.splats);
  RenderCounters c;
  c.camera_paths = c.light_paths = 1024;
  c.shadow_rays = 5;
  builder->add_counters(c, 0.25);
}

TEST(PartialBuilder, ThreadsInAnyOrderGiveTheSerialResult) {
  const FilmGrid grid{150, 110, {5, 7, 141, 103}};
  const TileSpec tile{grid.cells(), 0, 16};
  const std::vector<Work> work = make_work(grid, tile.cells, 3);
  PartialBuilder serial(grid, tile, kQuantum, true, true);
  for (const Work& w : work) add(w, &serial);
  const Partial expected = serial.take();
  ASSERT_FALSE(expected.splats.empty());
  EXPECT_EQ(expected.light_paths, 1024 * work.size());

  PartialBuilder concurrent(grid, tile, kQuantum, true, true);
  std::vector<std::thread> threads;
  for (size_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (size_t i = work.size(); i-- > 0;) {
        if (i % 4 == t) add(work[i], &concurrent);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(concurrent.take(), expected);
}

TEST(PartialBuilder, SplatsMatchAPlainSumAndIgnoreOtherPixels) {
  const FilmGrid grid{70, 40, {10, 5, 60, 37}};
  PartialBuilder builder(grid, {grid.cells(), 0, 1}, kQuantum, false, true);
  std::mt19937_64 rng(11);
  std::vector<Splat> splats;
  std::vector<ExactRgb> expected(70 * 40);
  for (int i = 0; i < 5000; ++i) {
    // Also pixels above the film's last one.
    const Splat s{static_cast<uint32_t>(rng() % 4000), 0.5f, 0.25f, static_cast<float>(rng() % 7)};
    splats.push_back(s);
    if (grid.crop_index(s.pixel) < 0) continue;
    expected[s.pixel] += {{*to_units(s.r, kQuantum), *to_units(s.g, kQuantum), *to_units(s.b, kQuantum)}};
  }
  builder.add_splats(splats);
  const Partial p = builder.take();
  std::vector<ExactRgb> found(70 * 40);
  int64_t last = -1;
  for (const auto& splat : p.splats) {
    EXPECT_GT(int64_t{splat.pixel}, last);
    last = splat.pixel;
    found[splat.pixel] = splat.sum;
  }
  EXPECT_EQ(found, expected);
}

TEST(PartialBuilder, SplatsKeepSixteenBitsWithoutBias) {
  const FilmGrid grid = testing::full_grid(64, 64);
  PartialBuilder builder(grid, {grid.cells(), 0, 1}, kQuantum, false, true);
  std::mt19937_64 rng(12);
  std::lognormal_distribution<float> value(0, 2);
  std::vector<Splat> splats;
  for (uint32_t pixel = 0; pixel < 64 * 64; ++pixel)
    splats.push_back({pixel, value(rng), 1.0f / 3, 16777215});
  builder.add_splats(splats);
  const Partial p = builder.take();
  ASSERT_EQ(p.splats.size(), splats.size());
  double bias = 0;
  for (size_t i = 0; i < splats.size(); ++i) {
    const double exact = splats[i].r;
    const double error = from_units(p.splats[i].sum.c[0], kQuantum) / exact - 1;
    EXPECT_LE(std::fabs(error), 0x1p-16) << exact;
    bias += error / static_cast<double>(splats.size());
    EXPECT_EQ(p.splats[i].sum.c[1] >> std::countr_zero(static_cast<uint64_t>(p.splats[i].sum.c[1])), 0xaaabu);
    EXPECT_EQ(from_units(p.splats[i].sum.c[2], kQuantum), 0x1p24) << "a carry reaches the exponent";
  }
  // Uniform errors of up to 2^-17 or twice that, by where a value lies in its binade: this is 6 deviations.
  EXPECT_LT(std::fabs(bias), 6 * 0x1p-16 / std::sqrt(3.0 * 64 * 64));
}

TEST(PartialBuilder, CountsSplatsThatCanNotBeRepresented) {
  const FilmGrid grid = testing::full_grid(40, 40);
  PartialBuilder builder(grid, {grid.cells(), 0, 1}, kQuantum, false, true);
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const std::vector<Splat> splats = {
      {0, nan, 1, 1}, {1, 1, inf, 1}, {2, 1, 1, -1}, {3, 1e30f, 1, 1}, {4, 1, 1, 1}};
  builder.add_splats(splats);
  const Partial p = builder.take();
  EXPECT_EQ(p.counters.nonfinite, 3u);
  EXPECT_EQ(p.dropped.of(DropKind::kNotFinite).count, 2u);
  EXPECT_EQ(p.dropped.of(DropKind::kOutOfRange).count, 1u);
  EXPECT_EQ(p.dropped.of(DropKind::kNegative).count, 0u);
  ASSERT_EQ(p.splats.size(), 2u);
  EXPECT_EQ(p.splats[0].pixel, 2u) << "of a filter's negative lobe";
  EXPECT_EQ(p.splats[1].pixel, 4u);
  EXPECT_TRUE(p.splats[0].sum.c[2] + p.splats[1].sum.c[2] == 0);
}

TEST(PartialBuilder, AmountsOfSplatsCountByLightPathsAndThoseOfSamplesBySamples) {
  const FilmGrid grid = testing::full_grid(40, 40);
  const TileSpec tile{grid.cells(), 0, 2};
  PartialBuilder builder(grid, tile, kQuantum, true, true);
  RenderCounters counters;
  counters.light_paths = 800;  // a quarter of the pixel samples
  builder.add_counters(counters, 0);
  builder.add_splats(std::vector<Splat>{{0, 3e30f, 0, 0}, {1, 1e-30f, 1e-30f, 1e-30f}, {2, 0, 0, 0}});
  Dropped of_camera_paths, of_light_paths;
  of_camera_paths.add(DropKind::kCapped, 0.5);
  of_light_paths.add(DropKind::kNotFinite, 1);
  builder.add_dropped(of_camera_paths, of_light_paths);
  const Partial p = builder.take();
  EXPECT_EQ(p.dropped.of(DropKind::kOutOfRange).count, 1u);
  EXPECT_NEAR(p.dropped.of(DropKind::kOutOfRange).amount, 4e30, 1e24);
  EXPECT_EQ(p.dropped.of(DropKind::kBelowRange).count, 1u);
  EXPECT_NEAR(p.dropped.of(DropKind::kBelowRange).amount, 4e-30, 1e-36);
  EXPECT_EQ(p.dropped.of(DropKind::kCapped), (Dropped::Kind{1, 0.5}));
  EXPECT_EQ(p.dropped.of(DropKind::kNotFinite), (Dropped::Kind{1, 4}));
}

TEST(PartialBuilder, CameraEntriesOutsideTheCropAreIgnored) {
  const FilmGrid grid{64, 64, {3, 4, 40, 50}};
  PartialBuilder builder(grid, {{0, 0, 2, 2}, 0, 1}, kQuantum, true, false);
  const std::vector<ExactRgb> ones(kCellPixels, ExactRgb{{1, 2, 3}});
  for (const int cy : {0, 1}) {
    for (const int cx : {0, 1}) builder.add_camera(cx, cy, std::span<const ExactRgb, kCellPixels>(ones));
  }
  const Partial p = builder.take();
  EXPECT_EQ(p.camera.size(), 37u * 46u);
  EXPECT_THAT(p.camera, ::testing::Each(ExactRgb{{1, 2, 3}}));
  EXPECT_TRUE(p.splats.empty());
  EXPECT_EQ(p.light_paths, 0u);
}

TEST(PartialBuilder, MisuseIsALogicError) {
  const FilmGrid grid = testing::full_grid(64, 64);
  EXPECT_THROW(PartialBuilder(grid, {{2, 0, 3, 1}, 0, 1}, kQuantum, true, true), std::logic_error);
  PartialBuilder lt(grid, {{0, 0, 1, 1}, 0, 1}, kQuantum, false, true);
  PartialBuilder pt(grid, {{0, 0, 1, 1}, 0, 1}, kQuantum, true, false);
  const std::vector<ExactRgb> sums(kCellPixels);
  EXPECT_THROW(lt.add_camera(0, 0, std::span<const ExactRgb, kCellPixels>(sums)), std::logic_error);
  EXPECT_THROW(pt.add_camera(1, 0, std::span<const ExactRgb, kCellPixels>(sums)), std::logic_error);
  EXPECT_THROW(pt.add_splats({}), std::logic_error);
}

}  // namespace
}  // namespace lightmill
