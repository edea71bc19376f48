// The spherical camera in both directions and both mappings.
#include "worker/render/camera/spherical.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

SphericalCamera spherical_camera(SphericalMapping mapping, int width, int height) {
  TestScene s;
  s.camera({1, 2, 3}, {-2, 0.5, 4}, 50);
  s.scene.camera.kind = CameraKind::kSpherical;
  s.scene.camera.mapping = mapping;
  return SphericalCamera(s.scene.camera, width, height);
}
constexpr SphericalMapping kMappings[] = {SphericalMapping::kEqualArea, SphericalMapping::kEquirectangular};

TEST(Spherical, ConnectInvertsRay) {
  Random random(1);
  for (const SphericalMapping mapping : kMappings) {
    const SphericalCamera camera = spherical_camera(mapping, 64, 48);
    for (int i = 0; i < 4000; ++i) {
      const auto x = static_cast<float>(random.between(0, 64)),
                 y = static_cast<float>(random.between(0.2, 47.8));
      const CameraRay<float> r = camera.ray(x, y, 0.0f, 0.0f);
      ASSERT_NEAR(dot(r.direction, r.direction), 1, 2e-6);
      const auto t = static_cast<float>(random.between(0.1, 5));
      const LensConnection<float> c = camera.connect(r.direction * t, 0.0f, 0.0f);
      ASSERT_TRUE(c.seen);
      EXPECT_NEAR(c.x, x, 2e-2);
      EXPECT_NEAR(c.y, y, 2e-2);
      EXPECT_NEAR(c.density * t * t / r.density, 1, 1e-4);
    }
  }
}

TEST(Spherical, DensityIsRasterAreaPerSolidAngle) {
  Random random(2);
  for (const SphericalMapping mapping : kMappings) {
    const SphericalCamera camera = spherical_camera(mapping, 64, 48);
    for (int i = 0; i < 300; ++i) {
      const auto x = static_cast<float>(random.between(1, 63)), y = static_cast<float>(random.between(3, 45));
      // The octahedral mapping has creases where the square's diagonals and axes are: stay on one facet.
      const float fx = x / 64, fy = y / 48, h = 0.1f;
      if (mapping == SphericalMapping::kEqualArea &&
          (std::fabs(fx - 0.5f) < 0.02f || std::fabs(fy - 0.5f) < 0.02f ||
           std::fabs(std::fabs(fx - 0.5f) + std::fabs(fy - 0.5f) - 0.5f) < 0.02f)) {
        continue;
      }
      const auto at = [&](float a, float b) { return camera.ray(a, b, 0.0f, 0.0f).direction; };
      const Vec3<float> dx = at(x + h, y) - at(x - h, y), dy = at(x, y + h) - at(x, y - h);
      const double solid_angle = std::fabs(double{dot(cross(dx, dy), at(x, y))}) / (4 * h * h);
      EXPECT_NEAR(camera.ray(x, y, 0.0f, 0.0f).density * solid_angle, 1, 1e-2) << x << ' ' << y;
    }
  }
}

TEST(Spherical, MappingsLookWherePbrtSays) {
  TestScene s;
  s.camera({0, 0, 0}, {0, 0, 1}, 90);
  s.scene.camera.kind = CameraKind::kSpherical;
  const SphericalCamera square(s.scene.camera, 100, 100);
  EXPECT_NEAR(square.ray(50.0f, 50.0f, 0.0f, 0.0f).direction.y, 1, 1e-6);  // up in the middle
  EXPECT_NEAR(square.ray(0.0f, 0.0f, 0.0f, 0.0f).direction.y, -1, 1e-6);
  EXPECT_NEAR(square.ray(100.0f, 50.0f, 0.0f, 0.0f).direction.x, 1, 1e-3);
  EXPECT_NEAR(square.ray(50.0f, 100.0f, 0.0f, 0.0f).direction.z, 1, 1e-3);
  s.scene.camera.mapping = SphericalMapping::kEquirectangular;
  const SphericalCamera map(s.scene.camera, 200, 100);
  EXPECT_NEAR(map.ray(0.0f, 50.0f, 0.0f, 0.0f).direction.x, 1, 1e-6);
  EXPECT_NEAR(map.ray(50.0f, 50.0f, 0.0f, 0.0f).direction.z, 1, 1e-6);
  EXPECT_NEAR(map.ray(20.0f, 0.0f, 0.0f, 0.0f).direction.y, 1, 1e-6);
}

// Beyond an edge the picture goes on with what the wrapped pixel shows.
TEST(Spherical, WrapFindsThePixelThatShowsTheSame) {
  Random random(3);
  for (const SphericalMapping mapping : kMappings) {
    const SphericalCamera camera = spherical_camera(mapping, 20, 14);
    for (int i = 0; i < 2000; ++i) {
      const int x0 = static_cast<int>(std::floor(random.between(-12, 32)));
      const int y0 = static_cast<int>(std::floor(random.between(-9, 23)));
      int x = x0, y = y0;
      camera.wrap(&x, &y);
      ASSERT_TRUE(x >= 0 && x < 20 && y >= 0 && y < 14);
      const auto at = [&](int a, int b) {
        return camera.ray(static_cast<float>(a) + 0.5f, static_cast<float>(b) + 0.5f, 0.0f, 0.0f).direction;
      };
      const Vec3<float> off = at(x, y) - at(x0, y0);
      ASSERT_LT(std::sqrt(dot(off, off)), 1e-3) << x0 << ' ' << y0;
    }
  }
}

TEST(Spherical, LanesHaveTheBitsOfScalars) {
  Random random(4);
  for (const SphericalMapping mapping : kMappings) {
    const SphericalCamera camera = spherical_camera(mapping, 64, 48);
    for (int round = 0; round < 500; ++round) {
      Float8 x{}, y{};
      for (int l = 0; l < 8; ++l) x[l] = random.uniform() * 66 - 1, y[l] = random.uniform() * 50 - 1;
      const CameraRay<Float8> r = camera.ray(x, y, Float8{}, Float8{});
      const LensConnection<Float8> c = camera.connect(r.direction, Float8{}, Float8{});
      for (int l = 0; l < 8; ++l) {
        const CameraRay<float> r1 = camera.ray(float{x[l]}, float{y[l]}, 0.0f, 0.0f);
        const LensConnection<float> c1 = camera.connect(r1.direction, 0.0f, 0.0f);
        ASSERT_EQ(float_bits(r.direction.x[l]), float_bits(r1.direction.x));
        ASSERT_EQ(float_bits(c.x[l]), float_bits(c1.x));
        ASSERT_EQ(float_bits(c.density[l]), float_bits(c1.density));
      }
    }
  }
}

}  // namespace
}  // namespace lightmill::test
