// The pinhole in both directions.
#include "worker/render/camera/perspective.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"
#include "worker/render/sampling/warp.h"

namespace lightmill::test {
namespace {

struct LookAtCase {
  const char* name;
  CameraDescription description;
  int width, height;
};

std::vector<LookAtCase> cameras() {
  TestScene s;
  s.camera({1, 2, 3}, {-2, 0.5, 4}, 50);
  CameraDescription mirrored = s.scene.camera;
  for (size_t i = 0; i < 3; ++i) mirrored.camera_to_world.m[i][0] *= -1;
  CameraDescription scaled = s.scene.camera;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) scaled.camera_to_world.m[i][j] *= 1000;
  }
  CameraDescription window = s.scene.camera;
  window.screen_window = std::array<double, 4>{-0.5, 1.5, -1, 0.25};
  CameraDescription wide = s.scene.camera;
  wide.fov_degrees = 150;
  return {{"plain", s.scene.camera, 64, 64},
          {"landscape", s.scene.camera, 160, 90},
          {"portrait", s.scene.camera, 31, 77},
          {"mirrored", mirrored, 64, 64},
          {"scaled", scaled, 64, 64},
          {"window", window, 64, 40},
          {"wide", wide, 100, 50},
          {"one_pixel", s.scene.camera, 1, 1},
          {"column", s.scene.camera, 1, 20000}};
}

TEST(Perspective, ProjectInvertsDirection) {
  Random random(1);
  for (const LookAtCase& c : cameras()) {
    const PerspectiveCamera camera(c.description, c.width, c.height);
    for (int i = 0; i < 2000; ++i) {
      const auto x = static_cast<float>(random.between(0, c.width)),
                 y = static_cast<float>(random.between(0, c.height));
      float cosine, px, py, back;
      const Vec3<float> w = camera.direction(x, y, &cosine);
      ASSERT_NEAR(dot(w, w), 1, 1e-6f);
      camera.project(w, &px, &py, &back);
      // A direction is known to a rounding error; on the image plane that grows by 1 / cos^2.
      const double per_pixel = std::min(camera.tan_per_pixel_x, camera.tan_per_pixel_y);
      const double tolerance = 4e-7 / (per_pixel * cosine * cosine) + 1e-6 * std::max(c.width, c.height);
      ASSERT_NEAR(px, x, tolerance) << c.name;
      ASSERT_NEAR(py, y, tolerance) << c.name;
      ASSERT_NEAR(back, cosine, 1e-6) << c.name;
      camera.project(-w, &px, &py, &back);
      ASSERT_LT(back, 0) << c.name;
    }
  }
}

// The density is that of one pixel's area: its integral over the solid angle of a small raster rectangle is
// the rectangle's area in pixels.
TEST(Perspective, DensityIsRasterAreaPerSolidAngle) {
  Random random(2);
  for (const LookAtCase& c : cameras()) {
    const PerspectiveCamera camera(c.description, c.width, c.height);
    for (int i = 0; i < 200; ++i) {
      const double x = random.between(0, c.width), y = random.between(0, c.height);
      // In double, from the camera's own numbers: solid angle = |du x dv| cos / d^2 on the image plane.
      const double dx = double{camera.tan_per_pixel_x} * 1e-2, dy = double{camera.tan_per_pixel_y} * 1e-2;
      const double px = x * camera.tan_per_pixel_x + camera.tan_x0,
                   py = y * camera.tan_per_pixel_y + camera.tan_y0;
      const double d2 = 1 + px * px + py * py, solid_angle = dx * dy / (d2 * std::sqrt(d2));
      const auto cosine = static_cast<float>(1 / std::sqrt(d2));
      ASSERT_NEAR(camera.pdf_solid_angle(cosine) * solid_angle, 1e-4, 1e-9) << c.name;
    }
  }
}

TEST(Perspective, DensityIntegratesToTheNumberOfPixels) {
  for (const LookAtCase& c : cameras()) {
    if (c.description.fov_degrees > 100) continue;
    const PerspectiveCamera camera(c.description, c.width, c.height);
    Random random(3);
    // Uniform directions of the hemisphere in front of the camera.
    const Vec3<float> forward{camera.forward[0], camera.forward[1], camera.forward[2]};
    const Frame<float> frame(forward);
    std::vector<double> batches(32);
    for (double& b : batches) {
      for (int i = 0; i < 20000; ++i) {
        Vec3<float> w = square_to_sphere(random.uniform(), random.uniform());
        w.z = std::fabs(w.z);
        float x, y, cosine;
        camera.project(frame.to_world(w), &x, &y, &cosine);
        if (x < 0 || y < 0 || x >= static_cast<float>(c.width) || y >= static_cast<float>(c.height)) continue;
        b += double{camera.pdf_solid_angle(cosine)} * 2 * M_PI / 20000;
      }
    }
    if (c.height == 20000) continue;  // a sliver that few directions meet
    EXPECT_TRUE(mean_is(estimate(batches), double{1} * c.width * c.height, {.resolution = 0.05})) << c.name;
  }
}

TEST(Perspective, AxesAndFieldOfView) {
  TestScene s;
  s.camera({0, 0, 0}, {0, 0, 1}, 90);  // pbrt's convention: +x right, +y up, +z forward
  const PerspectiveCamera camera(s.scene.camera, 200, 100);
  float cosine;
  Vec3<float> w = camera.direction(100.0f, 50.0f, &cosine);
  EXPECT_NEAR(w.z, 1, 1e-6);
  w = camera.direction(100.0f, 0.0f, &cosine);  // top edge: 45 degrees up, the fov is of the shorter side
  EXPECT_NEAR(w.y, std::sqrt(0.5), 1e-6);
  w = camera.direction(200.0f, 50.0f, &cosine);  // right edge
  EXPECT_NEAR(w.x / w.z, 2, 1e-5);
}

TEST(Perspective, SingularTransformIsRefused) {
  CameraDescription c;
  for (size_t i = 0; i < 3; ++i) c.camera_to_world.m[i][0] = 0;
  EXPECT_THROW(PerspectiveCamera(c, 8, 8), Error);
}

TEST(Perspective, LanesHaveTheBitsOfScalars) {
  Random random(4);
  for (const LookAtCase& c : cameras()) {
    const PerspectiveCamera camera(c.description, c.width, c.height);
    for (int round = 0; round < 200; ++round) {
      Float8 x{}, y{};
      for (int l = 0; l < 8; ++l)
        x[l] = random.uniform() * static_cast<float>(c.width),
        y[l] = random.uniform() * static_cast<float>(c.height);
      Float8 cosine, px, py, pc;
      const Vec3<Float8> w = camera.direction(x, y, &cosine);
      camera.project(w, &px, &py, &pc);
      for (int l = 0; l < 8; ++l) {
        float c1, x1, y1, p1;
        const Vec3<float> w1 = camera.direction(float{x[l]}, float{y[l]}, &c1);
        camera.project(w1, &x1, &y1, &p1);
        ASSERT_EQ(float_bits(w.x[l]), float_bits(w1.x));
        ASSERT_EQ(float_bits(px[l]), float_bits(x1));
        ASSERT_EQ(float_bits(py[l]), float_bits(y1));
        ASSERT_EQ(float_bits(camera.pdf_solid_angle(pc)[l]), float_bits(camera.pdf_solid_angle(p1)));
      }
    }
  }
}

}  // namespace
}  // namespace lightmill::test
