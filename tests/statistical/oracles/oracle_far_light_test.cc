// Distant, spot and image lights on a plane, against closed answers or quadrature. alpha = 1e-4
// per comparison.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "common/image/image.h"
#include "tests/statistical/oracles/form_factor.h"
#include "tests/support/render.h"
#include "worker/render/math/equal_area.h"

namespace lightmill::test {
namespace {

constexpr int kFarLightBatches = 16;
constexpr double kRho = 0.5;

class FarLight : public ::testing::TestWithParam<Integrator> {
 protected:
  static TestScene floor_scene() {
    TestScene s;
    s.quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, s.diffuse(static_cast<float>(kRho)));
    s.camera({0.5, 2, -1}, {0, 0, 0}, 30).film(16, 16);
    return s;
  }
  Batches render(const TestScene& s, int64_t spp) const {
    Batches b = render_batches(s.scene, settings_for(s.scene, GetParam(), spp, 1), kFarLightBatches);
    EXPECT_EQ(b.counters.nonfinite, 0u);
    return b;
  }
  int64_t spp() const { return GetParam() == Integrator::kLt ? 4096 : 1024; }
  MeanTest test() const { return {.resolution = GetParam() == Integrator::kLt ? 0.08 : 0.02}; }
};

// Irradiance L cos(theta).
TEST_P(FarLight, PlaneUnderADistantLight) {
  TestScene s = floor_scene();
  const Vec3d along = normalized({0.3, -0.8, 0.4});
  s.scene.lights.push_back({DistantLight{{3, 3, 3}, along}, {}});
  EXPECT_TRUE(mean_is(render(s, spp()).mean(), kRho / M_PI * 3 * -along.y, test()));
}

// Oracle 12, a sun of half angle alpha: E = pi L sin^2(alpha) cos(theta), and the same as the parallel light
// of that irradiance, over the stiff range. Seen directly its disc has radiance L, and nothing outside it
// has any.
TEST_P(FarLight, PlaneUnderASun) {
  for (const double alpha : {1e-5, 1e-4, 0.00465, 0.1, 0.6}) {
    TestScene s = floor_scene();
    const Vec3d along = normalized({0.3, -0.8, 0.4});
    DistantLight sun{{3, 3, 3}, along};
    sun.half_angle_degrees = alpha * 180 / M_PI;
    s.scene.lights.push_back({sun, {}});
    ASSERT_LT(alpha, std::asin(-along.y));  // all of it above the floor
    EXPECT_TRUE(mean_is(render(s, spp()).mean(), kRho / M_PI * 3 * -along.y, test())) << alpha;
  }
}

TEST_P(FarLight, TheSunItself) {
  if (GetParam() == Integrator::kLt) return;  // joins surfaces to the lens, and the sun is none
  for (const double alpha : {1e-3, 0.3}) {
    TestScene s;
    const Vec3d along = normalized({0.3, -0.8, 0.4});
    DistantLight sun{{3, 3, 3}, along};
    sun.half_angle_degrees = alpha * 180 / M_PI;
    s.scene.lights.push_back({sun, {}});
    const double radiance = 3 / (M_PI * std::sin(alpha) * std::sin(alpha));
    s.camera({0, 0, 0}, along * -1.0, alpha * 180 / M_PI).film(8, 8);  // the middle of the disc
    EXPECT_TRUE(mean_is(render(s, 256).mean(), radiance)) << alpha;
    // All of it: radiance x pi tan^2(alpha) over the picture's (2 tan(2 alpha))^2.
    s.camera({0, 0, 0}, along * -1.0, 4 * alpha * 180 / M_PI);
    const double share = M_PI * std::pow(std::tan(alpha) / (2 * std::tan(2 * alpha)), 2);
    EXPECT_TRUE(mean_is(render(s, 16384).mean(), radiance * share)) << alpha;
  }
}

// Inside the full cone a spot is a point light; in its falloff, that times the smoothstep.
TEST_P(FarLight, PlaneUnderASpotLight) {
  for (const double start : {80.0, 5.0}) {
    TestScene s = floor_scene();
    const Vec3d from{0.2, 1.5, 0.1}, axis = normalized({-0.1, -1, 0.05});
    s.scene.lights.push_back({SpotLight{{4, 4, 4}, from, axis, start, start == 80 ? 85.0 : 40.0}, {}});
    const auto radiance = [&](const Vec3d& p) {
      const Vec3d d = p - from;
      const double d2 = dot(d, d), cosine = dot(d, axis) / std::sqrt(d2);
      const double hi = std::cos(start * M_PI / 180), lo = std::cos((start == 80 ? 85.0 : 40.0) * M_PI / 180);
      const double x = std::clamp((cosine - lo) / (hi - lo), 0.0, 1.0);
      return kRho / M_PI * 4 * x * x * (3 - 2 * x) * 1.5 / std::pow(d2, 1.5);
    };
    EXPECT_TRUE(mean_is(render(s, spp()).mean(), mean_over_plane(s.scene, 0, radiance), test())) << start;
  }
}

// The floor integrates the upper half of an image: quadrature over the square in double.
TEST_P(FarLight, PlaneUnderAnImage) {
  std::string folder = (std::filesystem::temp_directory_path() / "lightmill-XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  Image image(4, 4);
  for (int i = 0; i < 48; ++i) image.data[static_cast<size_t>(i)] = static_cast<float>((i / 3 * 7) % 11);
  write_image(image, folder + "/sky.exr");
  TestScene s = floor_scene();
  InfiniteLight light{{1, 1, 1}, folder + "/sky.exr", {}};
  light.light_to_world.m = {
      {{1, 0, 0, 0}, {0, 0, 1, 0}, {0, -1, 0, 0}, {0, 0, 0, 1}}};  // light z to world -y
  s.scene.lights.push_back({light, {}});
  double irradiance = 0;
  constexpr int kSteps = 2048;
  for (int y = 0; y < kSteps; ++y) {
    for (int x = 0; x < kSteps; ++x) {
      const float u = (static_cast<float>(x) + 0.5f) / kSteps, v = (static_cast<float>(y) + 0.5f) / kSteps;
      const double up = -equal_area_square_to_sphere(u, v).z;
      if (up > 0)
        irradiance +=
            image.pixel(x * 4 / kSteps, y * 4 / kSteps)[0] * up * 4 * M_PI / (double{kSteps} * kSteps);
    }
  }
  EXPECT_TRUE(mean_is(render(s, spp()).mean(), kRho / M_PI * irradiance, test()));
  std::filesystem::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Integrators, FarLight,
                         ::testing::Values(Integrator::kPt, Integrator::kBdpt, Integrator::kLt),
                         [](const auto& p) { return name_of(p.param); });

}  // namespace
}  // namespace lightmill::test
