// Scenes of few primitives, which have no tree: what is hit is what the tree of the ray tracing library
// names.
#include "worker/render/accel/few_primitives.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/support/random_direction.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

struct RaySet {
  std::vector<float> ox, oy, oz, dx, dy, dz, tfar;
  std::vector<int32_t> ids;

  void add(const Vec3<float>& o, const Vec3<float>& d, float end = INFINITY) {
    ids.push_back(static_cast<int32_t>(ids.size()));
    ox.push_back(o.x), oy.push_back(o.y), oz.push_back(o.z);
    dx.push_back(d.x), dy.push_back(d.y), dz.push_back(d.z);
    tfar.push_back(end);
  }
  RayView view() const { return {ox.data(), oy.data(), oz.data(), dx.data(), dy.data(), dz.data()}; }
  int size() const { return static_cast<int>(ids.size()); }
};

std::vector<int32_t> closest(const Accel& accel, const RaySet& rays) {
  std::vector<int32_t> prim(rays.ids.size(), -2);
  std::vector<TracedRay> traced;
  for (size_t i = 0; i < prim.size(); ++i)
    traced.push_back({{rays.ox[i], rays.oy[i], rays.oz[i]}, {rays.dx[i], rays.dy[i], rays.dz[i]}, -2, -2});
  accel.closest_hits(traced.data(), rays.ids.data(), rays.size());
  for (size_t i = 0; i < prim.size(); ++i) prim[i] = traced[i].prim;
  return prim;
}
std::vector<uint8_t> occluded(const Accel& accel, const RaySet& rays) {
  std::vector<uint8_t> out(rays.ids.size(), 2);
  accel.occluded(rays.view(), rays.tfar.data(), rays.size(), out.data());
  return out;
}

Vec3d random_point_in(Random& random, double size) {
  return {random.between(-size, size), random.between(-size, size), random.between(-size, size)};
}
Vec3<float> rounded(const Vec3d& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

/// Boxes, parallelograms, triangles that share edges or nothing, and spheres.
TestScene some_of_everything(Random& random) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  s.box({-1, -1, -1}, {1, 1, 1}, grey);
  for (int i = 0; i < 3; ++i) {
    const Vec3d lo = random_point_in(random, 0.8);
    s.box(lo, lo + Vec3d{random.between(0.1, 0.4), random.between(0.1, 0.4), random.between(0.1, 0.4)}, grey);
    s.quad(random_point_in(random, 0.8), random_point_in(random, 0.5), random_point_in(random, 0.5), grey);
    const Vec3d a = random_point_in(random, 0.8), b = a + random_point_in(random, 0.5),
                c = a + random_point_in(random, 0.5);
    s.triangle(a, b, c, grey).triangle(c, b, a + random_point_in(random, 0.5), grey);
    s.sphere(random_point_in(random, 0.8), random.between(0.02, 0.3), grey);
  }
  return s.camera(random_point_in(random, 0.9), {0, 0, 0}, 60);
}

TEST(FewPrimitives, NamesThePrimitivesThatTheTreeNames) {
  Random random(1);
  int64_t rays_cast = 0, hits = 0, differing = 0, blocked = 0, differently_blocked = 0;
  for (int trial = 0; trial < 40; ++trial) {
    const TestScene s = some_of_everything(random);
    const RenderScene scene = build_scene(s.scene);
    ASSERT_TRUE(FewPrimitives::suits(scene));
    const Accel few(scene, 1), tree(scene, 1, Structure::kTree);
    RaySet rays;
    for (int i = 0; i < 5003; ++i)
      rays.add(rounded(random_point_in(random, 1)), unit(random), static_cast<float>(random.between(0, 2)));
    const auto a = closest(few, rays), b = closest(tree, rays);
    const auto oa = occluded(few, rays), ob = occluded(tree, rays);
    for (size_t i = 0; i < a.size(); ++i) {
      ++rays_cast;
      hits += b[i] >= 0;
      differing += a[i] != b[i];
      blocked += ob[i];
      differently_blocked += oa[i] != ob[i];
    }
  }
  EXPECT_GT(hits, rays_cast / 2);
  EXPECT_GT(blocked, rays_cast / 10);
  EXPECT_LT(blocked, rays_cast * 9 / 10);
  // At an edge rounding decides: within 2^-20 of one are that share of all rays, or fewer.
  EXPECT_LE(differing, rays_cast >> 16);
  EXPECT_LE(differently_blocked, rays_cast >> 16);
}

TEST(FewPrimitives, NothingSlipsThroughEdgesAndCorners) {
  Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    // A closed octahedron of any shape and a box around it, seen from inside the octahedron.
    TestScene s;
    const int grey = s.diffuse(0.5f);
    Vec3d tip[6];
    for (int i = 0; i < 6; ++i) {
      tip[i] = random_point_in(random, 0.1);
      (&tip[i].x)[i / 2] += i % 2 ? -1 : 1;
    }
    for (int octant = 0; octant < 8; ++octant)
      s.triangle(tip[octant & 1], tip[2 + (octant >> 1 & 1)], tip[4 + (octant >> 2)], grey);
    if (trial % 2) s.box({-2, -2, -2}, {2, 2, 2}, grey);
    s.camera({0, 0, 0}, {0, 0, 1}, 60);
    const RenderScene scene = build_scene(s.scene);
    const Accel few(scene, 1);
    RaySet rays;
    const Vec3<float> o = trial % 3 ? Vec3<float>{} : unit(random) * 0.1f;
    for (size_t t = 0; t < 8; ++t) {
      for (size_t k = 0; k < 3; ++k) {
        const float* a = &scene.positions[static_cast<size_t>(scene.indices[3 * t + k]) * 3];
        const float* b = &scene.positions[static_cast<size_t>(scene.indices[3 * t + (k + 1) % 3]) * 3];
        for (int i = 0; i <= 64; ++i) {
          const float u = static_cast<float>(i) / 64;
          rays.add(
              o,
              Vec3<float>{a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1]), a[2] + u * (b[2] - a[2])} - o);
        }
      }
    }
    for (const int32_t p : closest(few, rays)) ASSERT_TRUE(p >= 0 && p < 8) << p;
    for (const uint8_t b : occluded(few, rays)) ASSERT_EQ(b, 1);
  }
}

TEST(FewPrimitives, ARayIsTracedAloneAsAmongOthers) {
  Random random(3);
  const RenderScene scene = build_scene(some_of_everything(random).scene);
  const Accel few(scene, 1);
  RaySet rays;
  for (int i = 0; i < 101; ++i)
    rays.add(rounded(random_point_in(random, 1)), unit(random), static_cast<float>(random.between(0, 2)));
  const auto prim = closest(few, rays);
  const auto blocked = occluded(few, rays);
  for (size_t i = 0; i < prim.size(); ++i) {
    RaySet one;
    one.add({rays.ox[i], rays.oy[i], rays.oz[i]}, {rays.dx[i], rays.dy[i], rays.dz[i]}, rays.tfar[i]);
    ASSERT_EQ(closest(few, one)[0], prim[i]);
    ASSERT_EQ(occluded(few, one)[0], blocked[i]);
  }
}

TEST(FewPrimitives, ManyMaskedOrInstancedPrimitivesHaveATree) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  s.box({-1, -1, -1}, {1, 1, 1}, grey).camera({0, 0, 0}, {0, 0, 1}, 60);
  EXPECT_TRUE(FewPrimitives::suits(build_scene(s.scene)));
  TestScene masked = s;
  masked.scene.shapes[0].alpha.value = 0.5f;
  EXPECT_FALSE(FewPrimitives::suits(build_scene(masked.scene)));
  for (int i = 0; i < 20; ++i) s.box({-1, -1, -1}, {1.5 + i, 1.5 + i, 1.5 + i}, grey);
  EXPECT_FALSE(FewPrimitives::suits(build_scene(s.scene)));
}

}  // namespace
}  // namespace lightmill::test
