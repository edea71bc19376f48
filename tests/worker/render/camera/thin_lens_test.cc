// The thin lens in both directions.
#include "worker/render/camera/thin_lens.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

CameraDescription with_lens(double radius, double focal_distance) {
  TestScene s;
  s.camera({1, 2, 3}, {-2, 0.5, 4}, 50);
  s.scene.camera.lens_radius = radius;
  s.scene.camera.focal_distance = focal_distance;
  return s.scene.camera;
}

TEST(ThinLens, ConnectInvertsRay) {
  Random random(1);
  for (const double focus : {0.3, 2.0, 1e6}) {
    const ThinLensCamera camera(with_lens(0.2, focus), 64, 48, 0);
    for (int i = 0; i < 2000; ++i) {
      const auto x = static_cast<float>(random.between(0, 64)), y = static_cast<float>(random.between(0, 48));
      const float u = random.uniform(), v = random.uniform();
      const CameraRay<float> r = camera.ray(x, y, u, v);
      ASSERT_NEAR(dot(r.direction, r.direction), 1, 1e-6);
      const auto t = static_cast<float>(random.between(0.5, 5));
      const LensConnection<float> c = camera.connect(r.origin + r.direction * t, u, v);
      ASSERT_TRUE(c.seen);
      EXPECT_NEAR(c.x, x, 2e-3) << focus;
      EXPECT_NEAR(c.y, y, 2e-3) << focus;
      EXPECT_NEAR(c.density * t * t / r.density, 1, 1e-4);
      EXPECT_NEAR(dot(c.direction, r.direction), -1, 1e-6);
      const Vec3<float> off = c.lens - r.origin;
      EXPECT_EQ(dot(off, off), 0);
      EXPECT_FALSE(camera.connect(r.origin - r.direction * t, u, v).seen);
    }
  }
}

TEST(ThinLens, RaysOfARasterPointMeetOnThePlaneOfFocus) {
  const CameraDescription description = with_lens(0.2, 1.7);
  const ThinLensCamera camera(description, 64, 48, 0);
  const PerspectiveCamera pinhole(description, 64, 48);
  Random random(2);
  double widest = 0;
  for (int i = 0; i < 1000; ++i) {
    const auto x = static_cast<float>(random.between(0, 64)), y = static_cast<float>(random.between(0, 48));
    float cosine;
    const Vec3<float> forward = pinhole.direction(x, y, &cosine), focus = forward * (1.7f / cosine);
    const CameraRay<float> r = camera.ray(x, y, random.uniform(), random.uniform());
    const Vec3<float> to = focus - r.origin, across = to - r.direction * dot(to, r.direction);
    EXPECT_LT(std::sqrt(dot(across, across)), 2e-6);
    const double radius = std::sqrt(dot(r.origin, r.origin));
    ASSERT_LE(radius, 0.2 * (1 + 1e-6));
    widest = std::max(widest, radius);
  }
  EXPECT_GT(widest, 0.199);
}

// density = d(raster) / d(solid angle), by finite differences in double on the shear's own formula.
TEST(ThinLens, DensityIsRasterAreaPerSolidAngle) {
  const ThinLensCamera camera(with_lens(0.2, 0.5), 64, 48, 0);
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const auto x = static_cast<float>(random.between(1, 63)), y = static_cast<float>(random.between(1, 47));
    const float u = random.uniform(), v = random.uniform(), h = 0.5f;
    const Vec3<float> d = camera.ray(x, y, u, v).direction;
    const Vec3<float> dx = camera.ray(x + h, y, u, v).direction - camera.ray(x - h, y, u, v).direction;
    const Vec3<float> dy = camera.ray(x, y + h, u, v).direction - camera.ray(x, y - h, u, v).direction;
    const double solid_angle = std::fabs(double{dot(cross(dx, dy), d)});
    EXPECT_NEAR(camera.ray(x, y, u, v).density * solid_angle, 1, 2e-3);
  }
}

TEST(ThinLens, PowersOfTwoOfTheUnitLeaveTheBitsAlone) {
  const ThinLensCamera one(with_lens(0.2, 1.7), 64, 48, 0);
  for (const int k : {-60, -7, 60}) {
    const ThinLensCamera other(with_lens(std::ldexp(0.2, k), std::ldexp(1.7, k)), 64, 48, -k);
    EXPECT_EQ(one.lens.radius_x, other.lens.radius_x);
    EXPECT_EQ(one.lens.radius_y, other.lens.radius_y);
    EXPECT_EQ(one.lens.shear_x, other.lens.shear_x);
    EXPECT_EQ(one.lens.shear_y, other.lens.shear_y);
  }
}

TEST(ThinLens, LengthsOutOfProportionAreRefused) {
  EXPECT_THROW(ThinLensCamera(with_lens(1e30, 1e30), 8, 8, 0), Error);
  EXPECT_THROW(ThinLensCamera(with_lens(1, 1e-30), 8, 8, 0), Error);
}

TEST(ThinLens, LanesHaveTheBitsOfScalars) {
  Random random(4);
  const ThinLensCamera camera(with_lens(0.2, 1.7), 64, 48, 3);
  for (int round = 0; round < 500; ++round) {
    Float8 x{}, y{}, u{}, v{};
    for (int l = 0; l < 8; ++l) {
      x[l] = random.uniform() * 64, y[l] = random.uniform() * 48, u[l] = random.uniform(),
      v[l] = random.uniform();
    }
    const CameraRay<Float8> r = camera.ray(x, y, u, v);
    const LensConnection<Float8> c = camera.connect(r.direction * splat<Float8>(3.0f) + r.origin, v, u);
    for (int l = 0; l < 8; ++l) {
      const CameraRay<float> r1 = camera.ray(float{x[l]}, float{y[l]}, float{u[l]}, float{v[l]});
      const LensConnection<float> c1 =
          camera.connect(r1.direction * 3.0f + r1.origin, float{v[l]}, float{u[l]});
      ASSERT_EQ(float_bits(r.direction.x[l]), float_bits(r1.direction.x));
      ASSERT_EQ(float_bits(r.origin.y[l]), float_bits(r1.origin.y));
      ASSERT_EQ(float_bits(r.density[l]), float_bits(r1.density));
      ASSERT_EQ(float_bits(c.x[l]), float_bits(c1.x));
      ASSERT_EQ(float_bits(c.density[l]), float_bits(c1.density));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
