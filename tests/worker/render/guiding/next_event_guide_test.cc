// Light guides: the bins of a sky are drawn by a table and texels in them by their light; densities are those
// of the samples, lanes have the bits of scalars, and what comes in is what comes in without a guide.
#include "worker/render/guiding/next_event_guide.h"

#include <gtest/gtest.h>

#include <numeric>

#include "common/image/image.h"
#include "tests/support/temporary_folder.h"
#include "tests/worker/render/light/light_cases.h"

namespace lightmill::test {
namespace {

/// Of a sky of 32 x 32 texels: some black, one row of bins all black, one texel a sun.
std::vector<double> sky_weights() {
  std::vector<double> weights(32 * 32);
  Random random(1);
  for (size_t i = 0; i < weights.size(); ++i)
    weights[i] = i % 5 == 0 || i < 64 ? 0 : 0.1 + double{random.uniform()};
  weights[500] = 1000;
  return weights;
}

/// Two tables: bins at random, of which some are never drawn.
BinnedDensity two_tables(const std::vector<double>& weights) {
  BinnedDensity bins(weights);
  Random random(2);
  for (int table = 0; table < 2; ++table) {
    std::vector<double> p;
    for (int b = 0; b < bins.count(); ++b)
      p.push_back(bins.weight[static_cast<size_t>(b)] > 0 && b % 3 != table ? double{random.uniform()} : 0);
    const double total = std::accumulate(p.begin(), p.end(), 0.0);
    for (double& x : p) x /= total;
    bins.add_table(p);
  }
  return bins;
}

TEST(BinnedDensity, DrawBinsByTheirTableAndTexelsByTheirLight) {
  const std::vector<double> weights = sky_weights();
  const BinnedDensity bins = two_tables(weights);
  ASSERT_EQ(bins.side, 16);
  ASSERT_EQ(bins.block, 2);
  constexpr int kSamples = 400000;
  for (int32_t table = 0; table < 2; ++table) {
    Random random(3);
    std::vector<double> observed(weights.size()), expected(weights.size());
    double total = 0;
    for (int32_t y = 0; y < 32; ++y) {
      for (int32_t x = 0; x < 32; ++x) {
        const double density = double{bins.density<float>(table, x, y)};
        total += density / 1024;
        expected[static_cast<size_t>(y * 32 + x)] = density / 1024 * kSamples;
        if (weights[static_cast<size_t>(y * 32 + x)] == 0) {
          EXPECT_EQ(density, 0);
        }
      }
    }
    EXPECT_NEAR(total, 1, 1e-5);
    // Within the bin of the sun, by light alone.
    const double sun = expected[500], beside = expected[501];
    if (sun > 0) {
      EXPECT_NEAR(sun / beside, 1000 / weights[501], 2);
    }
    for (int i = 0; i < kSamples; ++i) {
      float u = random.uniform(), v = random.uniform();
      int32_t x, y;
      bins.draw<float>(table, random.uniform(), &u, &v, &x, &y);
      ++observed[static_cast<size_t>(y * 32 + x)];
      ASSERT_TRUE(u >= 0 && u < 1 && v >= 0 && v < 1);
    }
    EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), 2));
  }
}

// Sides that 16 does not divide.
TEST(BinnedDensity, AreWholeTexels) {
  EXPECT_EQ(BinnedDensity(std::vector<double>(1, 1.0)).side, 1);
  EXPECT_EQ(BinnedDensity(std::vector<double>(64, 1.0)).side, 8);
  EXPECT_EQ(BinnedDensity(std::vector<double>(900, 1.0)).side, 15);
  EXPECT_EQ(BinnedDensity(std::vector<double>(37 * 37, 1.0)).side, 1);
  const BinnedDensity odd = BinnedDensity(std::vector<double>(18 * 18, 1.0));
  EXPECT_EQ(odd.side, 9);
  EXPECT_EQ(odd.bin<float>(17, 17), 80);
  EXPECT_EQ(odd.bin<float>(1, 2), 9);
}

TEST(BinnedDensity, LanesHaveTheBitsOfScalars) {
  const BinnedDensity bins = two_tables(sky_weights());
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    Float8 pick, u, v;
    Int8 table, x, y;
    for (int l = 0; l < 8; ++l) {
      pick[l] = random.uniform(), u[l] = random.uniform(), v[l] = random.uniform();
      table[l] = l % 2;
    }
    const Float8 u0 = u, v0 = v;
    bins.draw<Float8>(table, pick, &u, &v, &x, &y);
    const Float8 density = bins.density<Float8>(table, x, y);
    for (int l = 0; l < 8; ++l) {
      float us = u0[l], vs = v0[l];
      int32_t xs, ys;
      bins.draw<float>(table[l], pick[l], &us, &vs, &xs, &ys);
      ASSERT_EQ(xs, x[l]);
      ASSERT_EQ(ys, y[l]);
      ASSERT_EQ(us, u[l]);
      ASSERT_EQ(vs, v[l]);
      ASSERT_EQ(bins.density<float>(table[l], xs, ys), density[l]);
    }
  }
}

TEST(LightGrid, HasItsBordersAwayFromWalls) {
  std::vector<Vec3f> points;
  Random random(5);
  // A room of 4 x 2 x 1 with walls a quarter of a cell wide apart.
  for (int i = 0; i < 6000; ++i)
    points.push_back({static_cast<float>(i % 65) / 16, 2 * random.uniform(), static_cast<float>(i % 2)});
  const LightGrid grid = place_grid(points, 16);
  EXPECT_EQ(grid.cells[0], 17);
  EXPECT_EQ(grid.cells[1], 9);
  EXPECT_EQ(grid.cells[2], 5);
  for (const Vec3f& p : points) {
    const int32_t cell = grid.at<float>({p.x, p.y, p.z});
    ASSERT_GE(cell, 0);
    ASSERT_LT(cell, grid.count());
    ASSERT_EQ(grid.at<float>({p.x + 1e-5f, p.y, p.z - 1e-5f}), cell);
  }
  EXPECT_EQ(grid.at<float>({-1e30f, -1e30f, -1e30f}), 0);
  EXPECT_EQ(grid.at<float>({1e30f, 1e30f, 1e30f}), grid.count() - 1);
  EXPECT_EQ(place_grid(std::vector<Vec3f>(10, Vec3f{1, 2, 3}), 16).count(), 1);
}

/// A sky, a sun and two lamps over a floor, and a guide of two cells that knows nothing of where they are.
struct GuidedScene {
  TemporaryFolder folder;
  LightScene plain, guided;
  GuidedScene() : plain(scene()), guided(scene()) {
    LightTable& lights = guided.scene.lights;
    lights.environments[0].bins = BinnedDensity(lights.environments[0].weights());
    Random random(6);
    std::vector<LightMoments> tables(2);
    for (LightMoments& m : tables) {
      for (int i = 0; i < lights.count(); ++i) m.light.push_back(double{random.uniform()});
      std::vector<double>& bins = m.sky.emplace_back();
      for (int b = 0; b < lights.environments[0].bins.count(); ++b)
        bins.push_back(b % 3 ? double{random.uniform()} : 0);
    }
    LightGrid grid;
    grid.per_unit = {1, 1, 1};
    grid.cells = {2, 1, 1};
    const float middle = guided.at(1, 0, 0).x;
    grid.origin = {middle - 1, 0, 0};
    guide_lights(grid, {0, 1}, tables, {lights.infinite[0]}, &lights);
  }

 private:
  TestScene scene() {
    Image image(16, 16);
    Random random(7);
    for (float& x : image.data) x = random.uniform();
    write_image(image, folder.file("sky.exr"));
    TestScene s;
    s.quad({-2, -1, -2}, {0, 0, 4}, {4, 0, 0}, s.diffuse(0.5f));
    s.quad({-1, 1, -1}, {1, 0, 0}, {0, 0, 1}, s.diffuse(0), {.radiance = {5, 5, 5}});
    s.scene.lights.push_back({InfiniteLight{{1, 1, 1}, folder.file("sky.exr")}, {}});
    s.scene.lights.push_back({DistantLight{{2, 2, 2}, {0, -1, 0}, 10}, {}});
    return s;
  }
};

TEST(NextEventGuide, DensitiesAreThoseOfTheSamples) {
  const GuidedScene scene;
  const LightTable& lights = scene.guided.lights();
  ASSERT_TRUE(lights.guide.chooses());
  ASSERT_FALSE(lights.environments[0].bins.empty());
  Random random(8);
  std::vector<double> observed(static_cast<size_t>(2 * lights.count())), expected(observed.size());
  constexpr int kSamples = 50000;
  int rounded = 0;
  for (int i = 0; i < kSamples; ++i) {
    const bool right = random.uniform() < 0.5f;
    const Vec3<float> at = scene.guided.at(right ? 1.5 : 0.5, random.between(-1, 0.9), random.between(-1, 1));
    const auto d = sample_direct<float>(lights, at, random.uniform(), random.uniform(), random.uniform(),
                                        random.uniform());
    ++observed[static_cast<size_t>(right * lights.count() + d.light)];
    double total = 0;
    for (int32_t light = 0; light < lights.count(); ++light) {
      const double p = double{direct_selection<float>(lights, light, at)};
      expected[static_cast<size_t>(right * lights.count() + light)] += p;
      total += p;
    }
    ASSERT_NEAR(total, 1, 1e-5);
    if (!(d.pdf > 0) || d.distance2 == 0) continue;
    const float of_area = direct_pdf_area<float>(lights, d.light, at, d.wi, d.infinite ? 1 : d.distance2,
                                                 d.infinite ? 1 : d.cos_light);
    const float pdf = d.infinite ? of_area : of_area * d.distance2 / d.cos_light;
    // At a texel's border a direction may round into the next one.
    rounded += std::fabs(pdf / d.pdf - 1) > 1e-3f;
  }
  EXPECT_LT(rounded, kSamples / 1000);
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
}

TEST(NextEventGuide, WhatComesInIsTheSame) {
  const GuidedScene scene;
  for (const double x : {0.5, 1.5}) {
    const auto irradiance = [&](const LightScene& s, uint64_t seed) {
      const Vec3<float> at = s.at(x, -0.5, 0);
      Random random(seed);
      return mean_of(400000, [&] {
        const auto d = sample_direct<float>(s.lights(), at, random.uniform(), random.uniform(),
                                            random.uniform(), random.uniform());
        return d.wi.y > 0 && d.pdf > 0 ? double{d.radiance.x} * double{d.wi.y} / double{d.pdf} : 0.0;
      });
    };
    EXPECT_TRUE(means_agree(irradiance(scene.plain, 1), irradiance(scene.guided, 2), {.resolution = 0.05}));
  }
}

// Emission cells: light paths start in them by weight, everywhere in one alike, and bring what they bring
// from a disk.
TEST(EmissionCells, PathsStartByWeight) {
  TestScene s;
  s.quad({-2, -1, -2}, {0, 0, 4}, {4, 0, 0}, s.diffuse(0.5f));
  s.scene.lights.push_back({DistantLight{{2, 2, 2}, normalized({0.3, -1, 0.2}), 0}, {}});
  LightScene scene(s);
  LightTable& lights = scene.scene.lights;
  constexpr int kSide = 32, kSamples = 200000;
  std::vector<double> weights(kSide * kSide);
  Random random(9);
  for (double& w : weights) w = random.uniform() < 0.3f ? 0 : 0.1 + double{random.uniform()};
  lights.emission_cells.emplace_back(weights).add_table();
  lights.records[7] = 1;
  const LightRecord<float> r(lights, 0);
  const Frame<float> frame(r.vec(kLightN));
  const float radius = r.scalar(3);
  std::vector<double> observed(weights.size()), expected = weights;
  double total = 0, other = 0;
  for (const double w : weights) total += w;
  for (double& e : expected) e *= kSamples / total;
  const Estimate power = mean_of(kSamples, [&] {
    const auto e = sample_emission<float>(lights, 0, random.uniform(), random.uniform(), random.uniform(),
                                          random.uniform(), random.uniform());
    const Vec3<float> d = (e.point - r.vec(kLightP)) * (1 / radius);
    const auto place = [&](float x) {
      return std::clamp(static_cast<int>((x + 1) / 2 * kSide), 0, kSide - 1);
    };
    ++observed[static_cast<size_t>(place(dot(d, frame.t)) * kSide + place(dot(d, frame.s)))];
    EXPECT_NEAR(dot(d, frame.n), -1, 1e-5);
    // Of any point on the ray; but for rounding at a cell's border.
    const Vec3<float> on = e.point + e.direction * (radius * 3 * random.uniform());
    other += std::fabs(emission_pdf<float>(lights, 0, on, -e.direction, 1) / e.pdf - 1) > 1e-3f;
    return double{e.power.x};
  });
  EXPECT_LT(other, kSamples / 1000);
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
  // Of the cells that are drawn: radiance x area.
  double drawn = 0;
  for (const double w : weights) drawn += w > 0;
  const double area = 4.0 * radius * radius * drawn / (kSide * kSide);
  EXPECT_TRUE(mean_is(power, 2 * area, {.resolution = 0.02}));
}

}  // namespace
}  // namespace lightmill::test
