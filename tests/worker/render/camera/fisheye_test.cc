// Fisheyes, and the parts of an equirectangular picture, in both directions.
#include "worker/render/camera/fisheye.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"
#include "worker/render/camera/spherical.h"

namespace lightmill::test {
namespace {

CameraDescription description(CameraKind kind) {
  TestScene s;
  s.camera({1, 2, 3}, {-2, 0.5, 4}, 50);
  s.scene.camera.kind = kind;
  return s.scene.camera;
}

/// connect() inverts ray(), and the density is the raster's area over the solid angle that it shows.
template <class C>
void check(const C& camera, int width, int height, const char* name) {
  Random random(1);
  int seen = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto x = static_cast<float>(random.between(0.5, width - 0.5)),
               y = static_cast<float>(random.between(0.5, height - 0.5));
    const CameraRay<float> r = camera.ray(x, y, 0.0f, 0.0f);
    if (C::kWeighted && !(r.weight > 0)) continue;
    ++seen;
    ASSERT_NEAR(dot(r.direction, r.direction), 1, 4e-6) << name;
    const auto t = static_cast<float>(random.between(0.1, 5));
    const LensConnection<float> c = camera.connect(r.direction * t, 0.0f, 0.0f);
    ASSERT_TRUE(c.seen) << name << ' ' << x << ' ' << y;
    EXPECT_NEAR(c.x, x, 2e-2) << name;
    EXPECT_NEAR(c.y, y, 2e-2) << name;
    EXPECT_NEAR(c.density * t * t / r.density, 1, 2e-3) << name;
    constexpr float kStep = 0.1f;
    const auto at = [&](float a, float b) { return camera.ray(a, b, 0.0f, 0.0f); };
    if (C::kWeighted) {
      bool inside = true;
      for (const float dx : {-2.0f, 2.0f}) {  // at the edge solid angles change too much within a step
        for (const float dy : {-2.0f, 2.0f}) inside &= at(x + dx, y + dy).weight > 0;
      }
      if (!inside) continue;
    }
    const Vec3<float> dx = at(x + kStep, y).direction - at(x - kStep, y).direction,
                      dy = at(x, y + kStep).direction - at(x, y - kStep).direction;
    const double solid_angle = std::fabs(double{dot(cross(dx, dy), r.direction)}) / (4 * kStep * kStep);
    EXPECT_NEAR(r.density * solid_angle, 1, 2e-2) << name << ' ' << x << ' ' << y;
  }
  EXPECT_GT(seen, 1000) << name;
}

TEST(Fisheye, BothDirectionsAgree) {
  CameraDescription d = description(CameraKind::kFisheye);
  d.fisheye.fov_degrees = 200;
  check(FisheyeCamera(d, 64, 48), 64, 48, "equidistant");
  d.fisheye = {FisheyeProjection::kEquisolid, 170, 10.5, 36, 27};
  check(FisheyeCamera(d, 64, 48), 64, 48, "equisolid");
  d.fisheye = {FisheyeProjection::kMirrorBall};
  check(FisheyeCamera(d, 64, 48), 64, 48, "mirror ball");
  d.fisheye = {FisheyeProjection::kPolynomial};
  d.fisheye.coefficients = {1.2e-5, 0.05, 1e-4, -2e-5, 3e-7};
  check(FisheyeCamera(d, 64, 48), 64, 48, "polynomial");
}

// A polynomial of one term is an equidistant lens.
TEST(Fisheye, PolynomialOfOneTerm) {
  CameraDescription d = description(CameraKind::kFisheye);
  d.fisheye = {FisheyeProjection::kPolynomial, 160};
  d.fisheye.sensor_height = d.fisheye.sensor_width;
  d.fisheye.coefficients = {0, 80 * M_PI / 180 / 18, 0, 0, 0};
  const FisheyeCamera camera(d, 100, 100);
  d.fisheye.projection = FisheyeProjection::kEquidistant;
  const FisheyeCamera equidistant(d, 100, 100);
  for (const float x : {2.5f, 20.0f, 50.0f, 77.0f}) {
    const CameraRay<float> a = camera.ray(x, 45.0f, 0.0f, 0.0f), b = equidistant.ray(x, 45.0f, 0.0f, 0.0f);
    EXPECT_NEAR(dot(a.direction, b.direction), 1, 1e-5);
    EXPECT_NEAR(a.density / b.density, 1, 1e-3);
    EXPECT_EQ(a.weight, b.weight);
  }
  EXPECT_EQ(camera.ray(1.0f, 1.0f, 0.0f, 0.0f).weight, 0.0f);
}

// Where the angle would shrink again nothing is seen.
TEST(Fisheye, PolynomialEndsWhereItTurns) {
  CameraDescription d = description(CameraKind::kFisheye);
  d.fisheye = {FisheyeProjection::kPolynomial};
  d.fisheye.coefficients = {0, 0.05, -0.0025, 0, 0};  // up to 10 mm
  const FisheyeCamera camera(d, 360, 240);            // 10 pixels to the mm
  EXPECT_GT(camera.ray(180.0f + 98, 120.0f, 0.0f, 0.0f).weight, 0.0f);
  EXPECT_EQ(camera.ray(180.0f + 102, 120.0f, 0.0f, 0.0f).weight, 0.0f);
}

TEST(Fisheye, BeyondTheFieldOfViewIsNothing) {
  CameraDescription d = description(CameraKind::kFisheye);
  d.fisheye.fov_degrees = 120;
  const FisheyeCamera camera(d, 100, 100);
  EXPECT_EQ(camera.ray(1.0f, 1.0f, 0.0f, 0.0f).weight, 0.0f);
  const CameraRay<float> edge = camera.ray(99.99f, 50.0f, 0.0f, 0.0f);
  const Vec3<float> ahead{camera.forward[0], camera.forward[1], camera.forward[2]};
  EXPECT_NEAR(std::acos(dot(edge.direction, ahead)) * 180 / M_PI, 60, 0.05);
  EXPECT_FALSE(camera.connect(-ahead, 0.0f, 0.0f).seen);
  EXPECT_TRUE(camera.connect(ahead, 0.0f, 0.0f).seen);
}

TEST(PanoramaRange, BothDirectionsAgree) {
  CameraDescription d = description(CameraKind::kSpherical);
  d.mapping = SphericalMapping::kEquirectangular;
  d.range = PanoramaRange{};
  check(SphericalCamera(d, 64, 48), 64, 48, "whole");
  d.range = PanoramaRange{-60, 85, -35, 45};
  check(SphericalCamera(d, 64, 48), 64, 48, "part");
  d.range = PanoramaRange{100, 300, -80, 10};
  check(SphericalCamera(d, 64, 48), 64, 48, "behind");
}

TEST(PanoramaRange, LooksAheadInTheMiddle) {
  CameraDescription d = description(CameraKind::kSpherical);
  d.mapping = SphericalMapping::kEquirectangular;
  d.range = PanoramaRange{};
  const SphericalCamera camera(d, 100, 50);
  const auto along = [&](float x, float y, const float* axis) {
    return dot(camera.ray(x, y, 0.0f, 0.0f).direction, Vec3<float>{axis[0], axis[1], axis[2]});
  };
  EXPECT_NEAR(along(50, 25, camera.forward), 1, 1e-5);
  EXPECT_NEAR(along(75, 25, camera.right), 1, 1e-5);
  EXPECT_NEAR(along(50, 0, camera.up), 1, 1e-5);
}

}  // namespace
}  // namespace lightmill::test
