// Surface reconstruction: positions within their error bound, orientation, texture coordinates,
// normalisation.
#include "worker/render/scene/geometry/surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

Vec3<float> towards(const float* p) { return normalize(Vec3<float>{p[0], p[1], p[2]}); }

TEST(Surface, TrianglePositionIsWithinItsBoundOfThePlane) {
  Random random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    TestScene s;
    const auto point = [&] {
      return Vec3d{random.between(-1, 1), random.between(-1, 1), random.between(-1, 1)};
    };
    s.triangle(point(), point(), point(), s.diffuse(0.5f)).camera({0, 0, 0}, {0, 0, 1}, 60);
    const RenderScene scene = build_scene(s.scene);
    if (scene.triangle_count() == 0) continue;
    const float* p = scene.positions.data();
    float target[3];
    for (int i = 0; i < 3; ++i) target[i] = 0.3f * p[i] + 0.5f * p[3 + i] + 0.2f * p[6 + i];
    const Surface<float> hit = surface_at<float>(scene, 0, {}, towards(target));
    const Vec3d a{p[0], p[1], p[2]}, b{p[3], p[4], p[5]}, c{p[6], p[7], p[8]};
    const Vec3d n = normalized(cross(b - a, c - a));
    const double off = std::fabs(dot(Vec3d{hit.p.x, hit.p.y, hit.p.z} - a, n));
    ASSERT_LE(off, hit.error * (std::fabs(n.x) + std::fabs(n.y) + std::fabs(n.z)) * 1.0001);
    ASSERT_NEAR(std::fabs(dot(n, {hit.ng.x, hit.ng.y, hit.ng.z})), 1, 1e-4);
  }
}

TEST(Surface, ReverseOrientationTurnsNormals) {
  for (const bool inward : {false, true}) {
    TestScene s;
    s.quad({-1, -1, 2}, {0, 2, 0}, {2, 0, 0}, s.diffuse(0.5f), {.inward = inward});
    s.sphere({0, 0, 4}, 1, s.diffuse(0.5f), {.inward = inward});
    s.camera({0, 0, 0}, {0, 0, 1}, 60);
    const RenderScene scene = build_scene(s.scene);
    const Vec3<float> d = normalize(Vec3<float>{0.1f, 0.05f, 1});
    const float sign = inward ? -1.0f : 1.0f;
    EXPECT_NEAR(surface_at<float>(scene, 0, {}, d).ng.z, -sign, 1e-6f);  // u x v = -z
    EXPECT_LT(surface_at<float>(scene, 2, {}, d).ng.z * sign, 0);        // the sphere's near side
  }
}

TEST(Surface, TextureCoordinatesInterpolate) {
  TestScene s;
  TextureDescription t;
  t.kind = ConstantTexture{{0.5f, 0.5f, 0.5f}};
  s.scene.textures.push_back(t);
  DiffuseMaterial m;
  m.reflectance.texture = 0;
  MaterialDescription md;
  md.kind = m;
  s.scene.materials.push_back(md);
  TriangleMesh mesh;
  mesh.positions = {{-1, -1, 2}, {1, -1, 2}, {1, 1, 2}, {-1, 1, 2}};
  mesh.uvs = {{0, 0}, {2, 0}, {2, 3}, {0, 3}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  ShapeDescription shape;
  shape.kind = MeshShape{std::make_shared<TriangleMesh>(mesh)};
  shape.material = 0;
  s.scene.shapes.push_back(shape);
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  const Surface<float> hit = surface_at<float>(scene, 0, {}, normalize(Vec3<float>{0.5f, -0.5f, 2}));
  EXPECT_NEAR(hit.u, 1.5f, 1e-5f);   // (x + 1) of 2
  EXPECT_NEAR(hit.v, 0.75f, 1e-5f);  // (y + 1) / 2 * 3
}

TEST(Surface, LanesHaveTheBitsOfScalars) {
  TestScene s;
  const int m = s.diffuse(0.5f);
  s.box({-1, -1, -1}, {1, 1, 1}, m, {.inward = true})
      .sphere({0, 0, 0.5}, 0.2, m)
      .camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  Random random(3);
  for (int round = 0; round < 500; ++round) {
    Vec3<Float8> d;
    Int8 prim{};
    Vec3<float> ds[8];
    for (int l = 0; l < 8; ++l) {
      ds[l] = normalize(Vec3<float>{static_cast<float>(random.between(-1, 1)),
                                    static_cast<float>(random.between(-1, 1)), 1});
      d.x[l] = ds[l].x, d.y[l] = ds[l].y, d.z[l] = ds[l].z;
      prim[l] = static_cast<int32_t>(random.bits() % 13);
    }
    const Surface<Float8> h = surface_at<Float8>(scene, prim, {}, d);
    for (int l = 0; l < 8; ++l) {
      const Surface<float> g = surface_at<float>(scene, prim[l], {}, ds[l]);
      ASSERT_EQ(float_bits(h.p.x[l]), float_bits(g.p.x));
      ASSERT_EQ(float_bits(h.p.z[l]), float_bits(g.p.z));
      ASSERT_EQ(float_bits(h.error[l]), float_bits(g.error));
      ASSERT_EQ(float_bits(h.ng.z[l]), float_bits(g.ng.z));
      ASSERT_EQ(float_bits(h.ns.x[l]), float_bits(g.ns.x));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
