// Grids of media, cut into bricks: what is looked up, and what bounds it.
#include "worker/render/scene/media/volume_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/base/error.h"
#include "tests/support/render.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/volumes.h"
#include "worker/render/renderer.h"
#include "worker/render/scene/media/cloud.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

const GridBox kBox{5, 9, 17, {-1, 2, 0.5}, {1, 3, 4}};

float spread(double x, double y, double z) {
  return static_cast<float>(std::fabs(std::sin(91 * x + 37 * y + 13 * z)) * 3);
}

TestScene around(std::shared_ptr<const MediumGrid> grid, const Rgb& sigma_s = {1, 2, 0.5f}) {
  TestScene s;
  const int medium = add_grid_medium(&s, {}, sigma_s, std::move(grid));
  bounding_box(&s, {-5, -5, -5}, {5, 5, 5}, medium);
  s.point_light({0, 9, 0}, {1, 1, 1});
  s.camera({0.3, 0.7, -9}, {0, 0, 0}, 30).film(8, 8);
  return s;
}

/// The value at a point of medium space, by its definition.
double interpolated(const VolumeField& f, const Vec3d& p) {
  const auto cell = [](double x, double lo, double hi, int n) { return (x - lo) / (hi - lo) * n - 0.5; };
  const double at[3] = {cell(p.x, f.lo.x, f.hi.x, f.nx), cell(p.y, f.lo.y, f.hi.y, f.ny),
                        cell(p.z, f.lo.z, f.hi.z, f.nz)};
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    int i[3];
    double weight = 1;
    for (int a = 0; a < 3; ++a) {
      const double floor = std::floor(at[a]), t = at[a] - floor;
      i[a] = static_cast<int>(floor) + (corner >> a & 1);
      weight *= corner >> a & 1 ? t : 1 - t;
    }
    const bool inside = i[0] >= 0 && i[1] >= 0 && i[2] >= 0 && i[0] < f.nx && i[1] < f.ny && i[2] < f.nz;
    sum += weight * (inside ? f.values[static_cast<size_t>((i[2] * f.ny + i[1]) * f.nx + i[0])] : f.outside);
  }
  return sum;
}

TEST(VolumeTable, ValuesAreInterpolatedAndBounded) {
  auto grid = grid_of(field_of(kBox, spread));
  auto moved = std::make_shared<MediumGrid>(*grid);
  moved->medium_to_world = translation({1, -2, 0.5}) * rotation(30, {1, 2, 3}) * scaling({2, 0.5, -1});
  const RenderScene scene = build_scene(around(moved).scene);
  const FieldLanes<float> field{scene.volumes, kGridCoefficients};
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit;
  for (int i = 0; i < 5000; ++i) {
    const auto between = [&](double lo, double hi) { return lo + (hi - lo) * unit(random); };
    const Vec3d p{between(-1, 1), between(2, 3), between(0.5, 4)};
    const Vec3d n = scene.normalised_point(transform_point(moved->medium_to_world, p));
    const Vec3<float> q =
        field.point({static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)});
    const FieldCell<float> cell = field_cell<float>(field, q);
    const float value = field_value<float>(scene.volumes, cell);
    ASSERT_NEAR(value, interpolated(*grid->density, p), 2e-5) << i;
    // 2 is the largest coefficient; per unit of normalised space.
    const float extinction = std::ldexp(2 * value, -scene.scale_exponent);
    ASSERT_LE(extinction, std::fabs(scene.volumes.majorants[static_cast<size_t>(cell.brick)])) << i;
    const FieldLanes<Float8> lanes{scene.volumes, splat_int<Float8>(kGridCoefficients)};
    const Vec3<Float8> all{splat<Float8>(q.x), splat<Float8>(q.y), splat<Float8>(q.z)};
    ASSERT_EQ(lane(field_value<Float8>(scene.volumes, field_cell<Float8>(lanes, all)), 5), value) << i;
  }
}

TEST(VolumeTable, EmptyBricksShareTheirValuesAndHaveNoMajorant) {
  const auto ball = [](double x, double y, double z) { return x * x + y * y + z * z < 0.01 ? 1.0 : 0.0; };
  const RenderScene scene =
      build_scene(around(grid_of(field_of({63, 63, 63, {-1, -1, -1}, {1, 1, 1}}, ball))).scene);
  EXPECT_EQ(scene.volumes.bricks.size(), 512u);
  const auto filled = std::ranges::count_if(scene.volumes.majorants, [](float m) { return m != 0; });
  EXPECT_EQ(filled, 8);
  EXPECT_EQ(scene.volumes.values.size(), 9u * kBrickValues);
}

// A grid that has no room in memory is read in from a file; its values are the same.
TEST(VolumeTable, GridsBeyondTheBoundOfMemoryAreInFiles) {
  const TemporaryFolder folder;
  const GridBox box{176, 176, 176, {-1, -1, -1}, {1, 1, 1}};
  const TestScene scene = around(grid_of(field_of(box, spread)));
  BuildOptions options(1, 1 << 20);
  options.spill_folder = folder.file("");
  const RenderScene small = build_scene(scene.scene, true, {}, options), large = build_scene(scene.scene);
  EXPECT_TRUE(small.volumes.values.in_file());
  EXPECT_FALSE(large.volumes.values.in_file());
  EXPECT_TRUE(std::ranges::equal(small.volumes.values.span(), large.volumes.values.span()));
  EXPECT_EQ(small.volumes.majorants, large.volumes.majorants);
  EXPECT_LT(bytes_of(small) + (uint64_t{16} << 20), bytes_of(large));
}

// Null collisions would take for ever where a spike bounds what is thin.
TEST(VolumeTable, BricksThatAreTooDenseToTrackAreIntegrated) {
  const auto spike = [](double x, double, double) { return x > 0.9 ? 1e6 : 1e-3; };
  const RenderScene scene =
      build_scene(around(grid_of(field_of({32, 4, 4, {-1, -1, -1}, {1, 1, 1}}, spike))).scene);
  EXPECT_GT(scene.volumes.majorants.front(), 0);
  EXPECT_LT(scene.volumes.majorants[3], 0);
  const RenderScene absorbs = [&] {
    TestScene s = around(grid_of(field_of({2, 2, 2, {-1, -1, -1}, {1, 1, 1}}, spread)));
    std::swap(s.scene.media[0].sigma_a, s.scene.media[0].sigma_s);
    return build_scene(s.scene);
  }();
  EXPECT_LT(absorbs.volumes.majorants.front(), 0);
}

TEST(VolumeTable, ThePlanSaysHowItIsWalkedThrough) {
  const auto ball = [](double x, double y, double z) { return x * x + y * y + z * z < 0.01 ? 1.0 : 0.0; };
  const SceneDescription scene = around(grid_of(field_of({63, 63, 63, {-1, -1, -1}, {1, 1, 1}}, ball))).scene;
  const Renderer renderer(scene, settings_for(scene, Integrator::kPt, 4, 5), 1);
  const auto& items = renderer.plan().items;
  const auto item = std::ranges::find(items, "media that vary", &PlanItem::feature);
  ASSERT_NE(item, items.end());
  EXPECT_TRUE(item->needed);
  EXPECT_NE(item->reason.find("1 grid(s): of 512 bricks 8 are tracked, 0 are integrated"), std::string::npos)
      << item->reason;
}

TEST(VolumeTable, WhatIsTooDenseForFloatIsRefused) {
  const auto grid =
      grid_of(field_of({2, 2, 2, {-1, -1, -1}, {1, 1, 1}}, [](double, double, double) { return 1e25; }));
  EXPECT_THROW(build_scene(around(grid).scene), Error);
}

TEST(VolumeTable, CloudsAreTheirDensityAtTheVoxels) {
  const CloudDensity cloud;
  EXPECT_EQ(cloud_density(cloud, {0.3, 1, 0.7}), 0);   // above it
  EXPECT_EQ(cloud_density(cloud, {0.3, -1, 0.7}), 1);  // below
  const Vec3d lo{0, 0, 0}, hi{0.25, 0.5, 0.125};
  const VolumeField f = cloud_field(cloud, lo, hi, 2);
  EXPECT_EQ(f.ny, 200);  // 4 * 5 * 10 * 1.99 per unit, and one for the far face
  double error = 0, variation = 0;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit;
  for (int i = 0; i < 2000; ++i) {
    const Vec3d p{hi.x * unit(random), hi.y * unit(random), hi.z * unit(random)};
    const double exact = cloud_density(cloud, p);
    error += std::fabs(interpolated(f, p) - exact);
    variation += std::fabs(exact - 0.5);
  }
  EXPECT_LT(error, 0.05 * variation);
}

}  // namespace
}  // namespace lightmill::test
