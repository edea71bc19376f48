// The orthographic camera in both directions.
#include "worker/render/camera/orthographic.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

CameraDescription with_window(double x0, double x1, double y0, double y1) {
  TestScene s;
  s.camera({1, 2, 3}, {-2, 0.5, 4}, 50);
  s.scene.camera.kind = CameraKind::kOrthographic;
  s.scene.camera.screen_window = std::array<double, 4>{x0, x1, y0, y1};
  return s.scene.camera;
}

TEST(Orthographic, ConnectInvertsRay) {
  const OrthographicCamera camera(with_window(-0.5, 1.5, -1, 0.25), 64, 48, 2);
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const auto x = static_cast<float>(random.between(0, 64)), y = static_cast<float>(random.between(0, 48));
    const CameraRay<float> r = camera.ray(x, y, 0.0f, 0.0f);
    const auto t = static_cast<float>(random.between(0.1, 5));
    const LensConnection<float> c = camera.connect(r.origin + r.direction * t, 0.0f, 0.0f);
    ASSERT_TRUE(c.seen);
    EXPECT_NEAR(c.x, x, 2e-4);
    EXPECT_NEAR(c.y, y, 2e-4);
    EXPECT_EQ(c.density, r.density);
    EXPECT_EQ(dot(c.direction, r.direction), -dot(r.direction, r.direction));
    const Vec3<float> off = c.lens - r.origin;
    EXPECT_LT(std::sqrt(dot(off, off)), 4e-6);
    EXPECT_FALSE(camera.connect(r.origin - r.direction * t, 0.0f, 0.0f).seen);
  }
}

TEST(Orthographic, CornersAreThoseOfTheWindowAndTheDensityThatOfPixels) {
  TestScene s;
  s.camera({0, 0, 0}, {0, 0, 1}, 90);  // +x right, +y up
  s.scene.camera.kind = CameraKind::kOrthographic;
  s.scene.camera.screen_window = std::array<double, 4>{-0.5, 1.5, -1, 0.25};
  const OrthographicCamera camera(s.scene.camera, 64, 50, -1);
  const Vec3<float> top_left = camera.ray(0.0f, 0.0f, 0.0f, 0.0f).origin;
  EXPECT_NEAR(top_left.x, -0.25, 1e-6);
  EXPECT_NEAR(top_left.y, 0.125, 1e-6);
  const Vec3<float> bottom_right = camera.ray(64.0f, 50.0f, 0.0f, 0.0f).origin;
  EXPECT_NEAR(bottom_right.x, 0.75, 1e-6);
  EXPECT_NEAR(bottom_right.y, -0.5, 1e-6);
  EXPECT_NEAR(camera.pixel_density * 1.0 * 0.625, 64 * 50, 1e-2);
}

TEST(Orthographic, WindowsOutOfProportionAreRefused) {
  EXPECT_THROW(OrthographicCamera(with_window(-1e-20, 1e-20, -1, 1), 8, 8, 0), Error);
  EXPECT_THROW(OrthographicCamera(with_window(-1e20, 1e20, -1, 1), 8, 8, 0), Error);
}

TEST(Orthographic, LanesHaveTheBitsOfScalars) {
  Random random(4);
  const OrthographicCamera camera(with_window(-0.5, 1.5, -1, 0.25), 64, 48, 1);
  for (int round = 0; round < 500; ++round) {
    Float8 x{}, y{};
    for (int l = 0; l < 8; ++l) x[l] = random.uniform() * 64, y[l] = random.uniform() * 48;
    const CameraRay<Float8> r = camera.ray(x, y, Float8{}, Float8{});
    const LensConnection<Float8> c = camera.connect(r.origin + r.direction, Float8{}, Float8{});
    for (int l = 0; l < 8; ++l) {
      const CameraRay<float> r1 = camera.ray(float{x[l]}, float{y[l]}, 0.0f, 0.0f);
      const LensConnection<float> c1 = camera.connect(r1.origin + r1.direction, 0.0f, 0.0f);
      ASSERT_EQ(float_bits(r.origin.x[l]), float_bits(r1.origin.x));
      ASSERT_EQ(float_bits(c.x[l]), float_bits(c1.x));
      ASSERT_EQ(float_bits(c.lens.z[l]), float_bits(c1.lens.z));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
