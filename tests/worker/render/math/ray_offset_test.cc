// Rays that leave a surface never hit it again: random triangles and spheres at scales from 1e-6 to 1e6.
#include "worker/render/math/ray_offset.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random_direction.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"
#include "worker/render/accel/accel.h"
#include "worker/render/scene/geometry/surface.h"

namespace lightmill::test {
namespace {

int32_t first_hit(const Accel& accel, const Vec3<float>& o, const Vec3<float>& d) {
  const int32_t id = 0;
  TracedRay ray{{o.x, o.y, o.z}, {d.x, d.y, d.z}, -1, -1};
  accel.closest_hits(&ray, &id, 1);
  return ray.prim;
}

Vec3d random_point(Random& random, double size) {
  return {random.between(-size, size), random.between(-size, size), random.between(-size, size)};
}

TEST(RayOffset, NextFloatMovesByOneStep) {
  for (const float x : {1.0f, -1.0f, 0x1p-100f, 3e30f, -7e-20f}) {
    EXPECT_EQ(next_float(x, 1.0f), std::nextafter(x, INFINITY));
    EXPECT_EQ(next_float(x, -1.0f), std::nextafter(x, -INFINITY));
  }
  EXPECT_GT(next_float(0.0f, 1.0f), 0);
  EXPECT_LT(next_float(0.0f, -1.0f), 0);
}

TEST(RayOffset, NoTriangleIsHitByTheRaysThatLeaveIt) {
  Random random(1);
  int tested = 0;
  for (const double scale : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    for (int trial = 0; trial < 60; ++trial) {
      // The triangle is up to a hundred times smaller than its distance from the camera, and any shape.
      const double size = scale * std::pow(10.0, random.between(-2, 0));
      const Vec3d at = random_point(random, scale);
      const Vec3d a = at + random_point(random, size), b = at + random_point(random, size),
                  c = at + random_point(random, size);
      TestScene s;
      s.triangle(a, b, c, s.diffuse(0.5f)).camera(random_point(random, scale), at, 60);
      const RenderScene scene = build_scene(s.scene);
      if (scene.triangle_count() == 0) continue;
      const Accel accel(scene, 1);
      const float* p = scene.positions.data();
      for (int ray = 0; ray < 40; ++ray) {
        const auto u = static_cast<float>(random.between(0, 1)),
                   v = static_cast<float>(random.between(0, 1)) * (1 - u);
        float target[3];
        for (int i = 0; i < 3; ++i) target[i] = p[i] * (1 - u - v) + p[3 + i] * u + p[6 + i] * v;
        const Vec3<float> o{}, d = normalize(Vec3<float>{target[0], target[1], target[2]});
        if (first_hit(accel, o, d) != 0) continue;
        const Surface<float> hit = surface_at<float>(scene, 0, o, d);
        // In double: on which side of the triangle's plane do the origins lie?
        const double e1[3] = {double{p[3]} - p[0], double{p[4]} - p[1], double{p[5]} - p[2]};
        const double e2[3] = {double{p[6]} - p[0], double{p[7]} - p[1], double{p[8]} - p[2]};
        const Vec3d n = cross({e1[0], e1[1], e1[2]}, {e2[0], e2[1], e2[2]});
        for (int k = 0; k < 10; ++k) {
          const Vec3<float> w = unit(random);
          const double side = n.x * w.x + n.y * w.y + n.z * w.z;
          if (std::fabs(side) < 1e-4 * length(n)) continue;  // in the plane: there is no side
          const Vec3<float> from = offset_origin(hit.p, hit.error, hit.ng, w);
          const double height =
              n.x * (double{from.x} - p[0]) + n.y * (double{from.y} - p[1]) + n.z * (double{from.z} - p[2]);
          ASSERT_GT(height * side, 0) << "scale " << scale;
          ASSERT_EQ(first_hit(accel, from, w), -1) << "scale " << scale;
          ++tested;
        }
      }
    }
  }
  EXPECT_GT(tested, 50000);
}

TEST(RayOffset, ASphereIsHitFromInsideOnlyAndOnTheFarSide) {
  Random random(2);
  int tested = 0;
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (int trial = 0; trial < 100; ++trial) {
      const double radius = scale * std::pow(10.0, random.between(-3, 0));
      const Vec3d at = random_point(random, scale);
      TestScene s;
      s.sphere(at, radius, s.diffuse(0.5f)).camera(random_point(random, scale), at, 60);
      const RenderScene scene = build_scene(s.scene);
      const Accel accel(scene, 1);
      const float* sphere = scene.spheres.data();
      for (int ray = 0; ray < 40; ++ray) {
        const Vec3<float> out = unit(random);
        const Vec3<float> o{},
            d = normalize(Vec3<float>{sphere[0], sphere[1], sphere[2]} + out * (0.9f * sphere[3]));
        if (first_hit(accel, o, d) != 0) continue;
        const Surface<float> hit = surface_at<float>(scene, 0, o, d);
        for (int k = 0; k < 10; ++k) {
          const Vec3<float> w = unit(random);
          const float side = dot(w, hit.ng);
          if (std::fabs(side) < 0.02f) continue;
          const Vec3<float> from = offset_origin(hit.p, hit.error, hit.ng, w);
          ASSERT_EQ(first_hit(accel, from, w), side > 0 ? -1 : 0) << "scale " << scale << " cosine " << side;
          if (side < -0.1f) {
            const Surface<float> far = surface_at<float>(scene, 0, from, w);
            const Vec3<float> chord = far.p - hit.p;
            ASSERT_NEAR(std::sqrt(dot(chord, chord)) / (2 * sphere[3] * -side), 1, 0.05f)
                << "scale " << scale;
          }
          ++tested;
        }
      }
    }
  }
  EXPECT_GT(tested, 50000);
}

}  // namespace
}  // namespace lightmill::test
