// Occlusion tests that go on through what light passes straight, against the same segments walked from hit to
// hit.
#include <gtest/gtest.h>

#include <vector>

#include "tests/support/instanced_scene.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"
#include "worker/render/accel/accel.h"

namespace lightmill::test {
namespace {

Vec3d point_in(Random& random, double size) {
  return {random.between(-size, size), random.between(-size, size), random.between(-size, size)};
}

/// Surfaces, panes and boundaries of fog, triangles and spheres of each.
TestScene clutter(Random& random, int count, int instances) {
  TestScene s;
  const int grey = s.diffuse(0.5f), pane = s.thin_dielectric(1.5f);
  for (int i = 0; i < count; ++i) {
    s.sphere(point_in(random, 0.8), random.between(0.02, 0.2), i % 2 ? grey : pane);
    s.quad(point_in(random, 0.8), point_in(random, 0.5), point_in(random, 0.5), i % 3 ? pane : grey);
    const Vec3d a = point_in(random, 0.8);
    s.triangle(a, a + point_in(random, 0.4), a + point_in(random, 0.4), i % 2 ? pane : grey);
  }
  if (instances > 0) {
    const int object = begin_object(&s, "o");
    add_to_object(&s, object, MeshShape{ball_mesh(0.1, 32)}, pane);
    add_to_object(&s, object, MeshShape{ball_mesh(0.05, 32)}, grey);
    for (int i = 0; i < instances; ++i) {
      const Vec3d at = point_in(random, 0.8);
      instance(&s, object, translation({at.x, at.y, at.z}) * scaling({1, 1, random.between(0.5, 2)}));
    }
  }
  return s.camera(point_in(random, 0.9), {0, 0, 0}, 60);
}

struct Truth {
  bool blocked = false, crossed = false;
};

/// Begins again behind every hit.
Truth walked(const Accel& accel, const RenderScene& scene, const Vec3d& from, const Vec3d& by) {
  constexpr double kStep = 1e-5;
  Truth truth;
  for (double t = 0; t < 1;) {
    TracedRay ray{{}, {static_cast<float>(by.x), static_cast<float>(by.y), static_cast<float>(by.z)}, -1, -1};
    const Vec3d o = from + by * t;
    ray.origin[0] = static_cast<float>(o.x), ray.origin[1] = static_cast<float>(o.y),
    ray.origin[2] = static_cast<float>(o.z);
    // As closest_hits gives no distance: the largest step after which the same is still ahead.
    const int32_t id = 0;
    accel.closest_hits(&ray, &id, 1);
    if (ray.prim < 0) break;
    const auto occluded_up_to = [&](double end) {
      const float f[6] = {ray.origin[0],    ray.origin[1],    ray.origin[2],
                          ray.direction[0], ray.direction[1], ray.direction[2]};
      const auto tfar = static_cast<float>(end);
      uint8_t hit = 0;
      accel.occluded({&f[0], &f[1], &f[2], &f[3], &f[4], &f[5]}, &tfar, 1, &hit);
      return hit != 0;
    };
    if (!occluded_up_to(1 - t)) break;
    double low = 0, high = 1 - t;
    while (high - low > kStep / 4) {
      const double middle = (low + high) / 2;
      (occluded_up_to(middle) ? high : low) = middle;
    }
    if (scene.is_passed(ray.prim)) {
      truth.crossed = true;
    } else {
      truth.blocked = true;
    }
    t += high + kStep;
  }
  return truth;
}

void compare(int count, int instances, Structure structure) {
  Random random(7);
  int rays = 0, blocked = 0, crossed = 0, differing = 0;
  for (int trial = 0; trial < 10; ++trial) {
    const TestScene s = clutter(random, count, instances);
    const RenderScene scene = build_scene(s.scene);
    ASSERT_TRUE(scene.any_boundaries);
    ASSERT_EQ(scene.any_instances(), instances > 0);
    const Accel accel(scene, 1, structure);
    constexpr int kRays = 203;
    std::vector<float> f[6];
    std::vector<float> tfar(kRays, 1.0f);
    std::vector<Truth> truth;
    for (int i = 0; i < kRays; ++i) {
      const Vec3d from = point_in(random, 1), by = point_in(random, 1);
      const double row[6] = {from.x, from.y, from.z, by.x, by.y, by.z};
      for (int k = 0; k < 6; ++k) f[k].push_back(static_cast<float>(row[k]));
      truth.push_back(walked(accel, scene, from, by));
    }
    const RayView view{f[0].data(), f[1].data(), f[2].data(), f[3].data(), f[4].data(), f[5].data()};
    std::vector<uint8_t> stopped(kRays, 2), met(kRays, 2), by_anything(kRays, 2);
    accel.occluded(view, tfar.data(), kRays, stopped.data(), met.data());
    accel.occluded(view, tfar.data(), kRays, by_anything.data());
    for (size_t i = 0; i < kRays; ++i) {
      ++rays;
      blocked += stopped[i];
      crossed += !stopped[i] && met[i];
      differing += stopped[i] != truth[i].blocked;
      // What stops a ray may be found before what it crosses.
      differing += !stopped[i] && met[i] != truth[i].crossed;
      differing += by_anything[i] != (truth[i].blocked || truth[i].crossed);
    }
  }
  EXPECT_GT(blocked, rays / 20);
  EXPECT_GT(crossed, rays / 20);
  // The walk steps over what lies within 1e-5 of a hit.
  EXPECT_LE(differing, rays / 200);
}

TEST(Crossed, FewPrimitives) { compare(20, 0, Structure::kFastest); }
TEST(Crossed, ATree) { compare(20, 0, Structure::kTree); }
TEST(Crossed, ATreeOfMany) { compare(60, 0, Structure::kFastest); }
TEST(Crossed, Instances) { compare(10, 40, Structure::kFastest); }

}  // namespace
}  // namespace lightmill::test
