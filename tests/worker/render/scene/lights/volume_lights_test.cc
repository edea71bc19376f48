// Grids that shine, as lights: the densities of their points, and what next-event estimation makes of them.
#include "worker/render/scene/lights/volume_lights.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "common/scene/transform.h"
#include "tests/support/render.h"
#include "tests/support/volumes.h"
#include "worker/render/pipeline/connections/volume_light_sampling.h"
#include "worker/render/renderer.h"

namespace lightmill::test {
namespace {

/// Emission per unit length at a point of medium space: linear, and so what interpolation makes of it.
double emission_at(const Vec3d& p) { return (1 + p.x) * (3 - p.y); }

/// A grid of density 1 + x whose emission factor is 3 - y, turned and stretched, of which its box is a part.
std::shared_ptr<MediumGrid> slanted_grid() {
  const GridBox box{20, 10, 9, {-1, -1, -1}, {2, 2, 2}, 1};
  auto grid =
      std::make_shared<MediumGrid>(*grid_of(field_of(box, [](double x, double, double) { return 1 + x; })));
  grid->emission = field_of(box, [](double, double y, double) { return 3 - y; });
  grid->lo = {0, 0, 0}, grid->hi = {1, 1.5, 1};
  grid->medium_to_world = translation({1, -2, 0.5}) * rotation(30, {1, 2, 3}) * scaling({2, 0.5, -1});
  return grid;
}

TestScene around(const std::shared_ptr<MediumGrid>& grid) {
  TestScene s;
  const int medium = add_grid_medium(&s, {1, 1, 1}, {}, grid, 0, {1, 2, 0});
  s.scene.camera.medium = medium;
  s.camera({0.3, 0.7, -9}, {0, 0, 0}, 30).film(8, 8);
  return s;
}

TEST(VolumeLights, DensitiesIntegrateToOne) {
  const RenderScene scene = build_scene(around(slanted_grid()).scene);
  ASSERT_EQ(scene.lights.count(), 1);
  ASSERT_EQ(scene.lights.volumes.size(), 1u);
  const VolumeLight& light = scene.lights.volumes[0];
  const float* const grid = scene.volumes.records.data();
  // The box has 20 / 3 * 1 by 10 / 3 * 1.5 by 3 cells, of a volume of 2 * 0.5 * 1.
  const double whole = std::ldexp(1.5, 3 * scene.scale_exponent);
  double sum = 0, volume = 0;
  const auto count = [&](size_t i) {
    return std::bit_cast<int32_t>(grid[kGridCoefficients + kFieldBricks + i]);
  };
  for (const auto& at : light.bricks) {
    double cells = 1, all = 1;
    for (size_t i = 0; i < 3; ++i) {
      const BrickSide side(grid, i, at[i]);
      cells *= double{side.until} - double{side.from};
      all *= double{grid[kGridHi + i]} - double{grid[kGridLo + i]};
    }
    const auto number = static_cast<size_t>((at[2] * count(1) + at[1]) * count(0) + at[0]);
    volume += cells / all;
    sum += double{scene.volumes.drawn[number]} * whole * cells / all;
  }
  EXPECT_NEAR(volume, 1, 1e-6);  // no brick is missing
  EXPECT_NEAR(sum, 1, 1e-5);
}

// E[radiance / pdf] is the integral of j / d^2, what a point receives if nothing absorbs.
TEST(VolumeLights, PointsAreDrawnByTheirDensity) {
  const auto grid = slanted_grid();
  const TestScene s = around(grid);
  const Renderer renderer(s.scene, settings_for(s.scene, Integrator::kPt, 16, 2), 1);
  const StageContext& context = renderer.context();
  const RenderScene& scene = context.scene;
  const Vec3d seen_from{0.5, -3, 2};
  const Vec3d n = scene.normalised_point(seen_from);
  const Vec3<Lane> reference{splat<Lane>(static_cast<float>(n.x)), splat<Lane>(static_cast<float>(n.y)),
                             splat<Lane>(static_cast<float>(n.z))};
  constexpr int kSamples = 1 << 16;
  double sum[2] = {}, square = 0;
  for (int i = 0; i < kSamples / kLanes; ++i) {
    SampleStream<Lane> stream{};
    stream.key = splat_uint<Lane>(1234567);
    stream.index = as_uint(lane_index<Lane>() + i * kLanes);
    DirectSample<Lane> d = sample_direct<Lane>(context.lights, reference, Lane{}, Lane{}, Lane{}, Lane{});
    const LaneInt medium =
        sample_volume_lights(context, reference, stream, 1, splat_mask<Lane>(true), Lane{}, &d);
    for (int l = 0; l < kLanes; ++l) {
      ASSERT_EQ(lane(medium, l), 1);
      ASSERT_GT(lane(d.pdf, l), 0);
      const double x = double{lane(d.radiance.x, l)} / double{lane(d.pdf, l)};
      sum[0] += x / kSamples;
      sum[1] += double{lane(d.radiance.y, l)} / double{lane(d.pdf, l)} / kSamples;
      square += x * x / kSamples;
      EXPECT_EQ(lane(d.radiance.z, l), 0);
      // The point is where its distance says.
      const Vec3d p = scene.scene_point({lane(d.point.x, l), lane(d.point.y, l), lane(d.point.z, l)});
      const double way = std::ldexp(length(p - seen_from), scene.scale_exponent);
      ASSERT_NEAR(way * way, lane(d.distance2, l), 1e-4 * way * way);
    }
  }
  double exact = 0;
  constexpr int kSteps = 100;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      for (int k = 0; k < kSteps; ++k) {
        const Vec3d p{(i + 0.5) / kSteps, 1.5 * (j + 0.5) / kSteps, (k + 0.5) / kSteps};
        const Vec3d way = transform_point(grid->medium_to_world, p) - seen_from;
        exact += emission_at(p) / dot(way, way) * 1.5 / (kSteps * kSteps * kSteps);
      }
    }
  }
  exact = std::ldexp(exact, -scene.light_exponent);
  const double error = std::sqrt((square - sum[0] * sum[0]) / kSamples);
  EXPECT_NEAR(sum[0], exact, 4 * error);
  EXPECT_LT(error, 0.01 * exact);
  EXPECT_NEAR(sum[1], 2 * sum[0], 1e-4 * sum[1]);
}

TEST(VolumeLights, OnlyGridsThatShineAreLights) {
  const auto lights = [](std::shared_ptr<MediumGrid> grid, const Rgb& emission) {
    TestScene s;
    s.scene.camera.medium = add_grid_medium(&s, {1, 1, 1}, {}, std::move(grid), 0, emission);
    s.camera({0.3, 0.7, -9}, {0, 0, 0}, 30).film(8, 8);
    return build_scene(s.scene).lights.count();
  };
  EXPECT_EQ(lights(slanted_grid(), {1, 1, 1}), 1);
  EXPECT_EQ(lights(slanted_grid(), {}), 0);
  auto cold = slanted_grid();
  cold->temperature = field_of({2, 2, 2, {-1, -1, -1}, {2, 2, 2}}, [](double, double, double) { return 50; });
  EXPECT_EQ(lights(cold, {1, 1, 1}), 0);
}

}  // namespace
}  // namespace lightmill::test
