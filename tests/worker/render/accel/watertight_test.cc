// Closed meshes let nothing out: the reason for which the tree is traversed robustly, which costs some time.
// Without Embree's ROBUST flag a sixth of the rays below that aim at edges get out, and some of a million
// that do not.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/scene/mesh/tessellate.h"
#include "tests/support/random_direction.h"
#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"
#include "worker/render/accel/accel.h"

namespace lightmill::test {
namespace {

constexpr int kRays = 200000;

/// The part of the rays from around the origin that meets nothing of a ball of radius 1.
double leaks(int segments, bool at_edges) {
  auto mesh = std::make_shared<const TriangleMesh>(sphere_mesh(1, -1, 1, 2 * std::numbers::pi, segments));
  TestScene s;
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  ShapeDescription& shape = s.scene.shapes.emplace_back();
  shape.kind = MeshShape{mesh};
  shape.material = s.diffuse(0.5f);
  const RenderScene scene = build_scene(s.scene);
  const Accel accel(scene, 1, Structure::kTree);
  Random random(5);
  std::vector<TracedRay> rays;
  std::vector<int32_t> ids;
  const auto corner = [&](size_t i) {
    const float* p = &scene.positions[static_cast<size_t>(scene.indices[i]) * 3];
    return Vec3<float>{p[0], p[1], p[2]};
  };
  const float size = std::ldexp(0.2f, scene.scale_exponent);
  for (int i = 0; i < kRays; ++i) {
    const Vec3<float> o{size * random.uniform(), size * random.uniform(), size * random.uniform()};
    Vec3<float> d = unit(random);
    if (at_edges) {
      const size_t triangle = random.bits() % static_cast<size_t>(scene.triangle_count()) * 3;
      const Vec3<float> a = corner(triangle), b = corner(triangle + 1);
      const Vec3<float> to = a + (b - a) * random.uniform() - o;
      d = to * (1 / std::sqrt(dot(to, to)));
    }
    rays.push_back({{o.x, o.y, o.z}, {d.x, d.y, d.z}, -2, -2});
    ids.push_back(i);
  }
  accel.closest_hits(rays.data(), ids.data(), kRays);
  int missed = 0;
  for (const TracedRay& ray : rays) missed += ray.prim < 0;
  return static_cast<double>(missed) / kRays;
}

TEST(Watertight, NoRayLeavesAClosedMesh) {
  EXPECT_EQ(leaks(12, false), 0);
  EXPECT_EQ(leaks(300, false), 0);
}

TEST(Watertight, RaysAtEdgesOfACoarseMeshStayInside) { EXPECT_EQ(leaks(12, true), 0); }

// Triangles of a few hundred ulps: where several meet, rounding of the ray itself shows.
TEST(Watertight, HardlyAnyRayAtEdgesOfAFineMeshGetsOut) { EXPECT_LT(leaks(300, true), 0.02); }

}  // namespace
}  // namespace lightmill::test
