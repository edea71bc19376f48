// Instances: what is built once and what is multiplied out; surfaces where flattening puts them; rays that
// leave an instance never hit it again; the same bits at any scale and in any lane.
#include "worker/render/scene/geometry/instancing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/instanced_scene.h"
#include "tests/support/random_direction.h"
#include "tests/support/scaled_scene.h"
#include "tests/support/statistics.h"
#include "worker/render/accel/accel.h"
#include "worker/render/scene/geometry/surface.h"

namespace lightmill::test {
namespace {

struct Found {
  int32_t prim = -1, instance = -1;
  bool operator==(const Found&) const = default;
};
Found first_hit(const Accel& accel, const Vec3<float>& o, const Vec3<float>& d) {
  const int32_t id = 0;
  TracedRay ray{{o.x, o.y, o.z}, {d.x, d.y, d.z}, -1, -1};
  accel.closest_hits(&ray, &id, 1);
  return {ray.prim, ray.instance};
}
bool blocked(const Accel& accel, const Vec3<float>& o, const Vec3<float>& d, float tfar) {
  uint8_t hit = 0;
  accel.occluded({&o.x, &o.y, &o.z, &d.x, &d.y, &d.z}, &tfar, 1, &hit);
  return hit;
}

/// Rotation, mirror and a scale per axis between size / 4 and size.
Transform random_placement(Random& random, const Vec3d& at, double size) {
  const auto factor = [&] { return size * random.between(0.25, 1) * (random.between(0, 1) < 0.3 ? -1 : 1); };
  const Vec3d axis{random.between(0.1, 1), random.between(-1, 1), random.between(-1, 1)};
  return translation(at) * rotation(random.between(0, 360), axis) * scaling({factor(), factor(), factor()}) *
         rotation(random.between(0, 360), axis);
}

TEST(Instancing, GeometryIsStoredOnce) {
  TestScene s;
  const int o = begin_object(&s, "o");
  add_to_object(&s, o, MeshShape{ball_mesh(1, 32)}, s.diffuse(0.5f));
  for (int i = 0; i < 1000; ++i) instance(&s, o, translation({2.0 * i, 0, 5}));
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  const auto& mesh = *std::get<MeshShape>(s.scene.objects[0].shapes[0].kind).mesh;
  EXPECT_EQ(scene.triangle_count(), static_cast<int32_t>(mesh.triangles.size()));
  EXPECT_EQ(scene.positions.size(), 3 * mesh.positions.size() + 4);
  EXPECT_EQ(scene.primitive_material.size(), mesh.triangles.size());
  EXPECT_EQ(scene.instance_count(), 1000);
  EXPECT_EQ(scene.flattened_instances, 0u);
  const RenderScene flat = build_scene(flattened(s.scene));
  EXPECT_FALSE(flat.any_instances());
  EXPECT_NEAR(scene.surface_area, flat.surface_area, 1e-3 * flat.surface_area);
  EXPECT_NEAR(scene.bounds_radius, flat.bounds_radius, 1e-3 * flat.bounds_radius);
}

TEST(Instancing, WhatMustBeOrIsCheaperSoIsFlattened) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  const MeshShape ball{ball_mesh(1, 64)}, ball_small{ball_mesh(1, 8)};
  s.scene.area_lights.push_back({{1, 1, 1}, false, {}});
  const int unused = begin_object(&s, "unused"), once = begin_object(&s, "once"),
            small = begin_object(&s, "small"), lamp = begin_object(&s, "lamp");
  add_to_object(&s, unused, ball, grey);
  add_to_object(&s, once, ball, grey);
  add_to_object(&s, small, ball_small, grey);
  add_to_object(&s, lamp, ball, grey);
  add_to_object(&s, lamp, ball_small, grey).area_light = 0;
  instance(&s, once, {});
  for (int i = 0; i < 3; ++i) {
    instance(&s, small, translation({3.0 + i, 0, 0}));
    instance(&s, lamp, translation({0, 3.0 + 3 * i, 0}));
  }
  // Nearly flat, along no axis: float rays can't be taken there.
  instance(&s, lamp, rotation(45, {1, 1, 0}) * scaling({1, 1, 1e-6}) * rotation(30, {0, 1, 1}));
  const SplitScene split = split_instances(s.scene);
  ASSERT_EQ(split.objects.size(), 1u);
  EXPECT_EQ(split.objects[0].shapes.size(), 1u) << "the lamp without its light";
  EXPECT_EQ(split.instances.size(), 3u);
  EXPECT_EQ(split.flattened.size(), 1u + 3u + 3u + 2u);
  EXPECT_EQ(split.flattened_instances, 1u + 3u + 3u + 1u);
  const RenderScene scene = build_scene(s.scene);
  EXPECT_EQ(scene.lights.count(), build_scene(flattened(s.scene)).lights.count());
}

TEST(Instancing, TheCopiesOfSmallObjectsAreFew) {
  TestScene s;
  const MeshShape ball{ball_mesh(1, 8)};
  const size_t triangles = ball.mesh->triangles.size();
  ASSERT_LE(triangles, kSmallObject);
  constexpr size_t kUses = 300;
  for (int i = 0; i < 10; ++i) {
    const int o = begin_object(&s, "o" + std::to_string(i));
    add_to_object(&s, o, ball, s.diffuse(0.5f));
    for (size_t k = 0; k < kUses; ++k) instance(&s, o, translation({static_cast<double>(k), 3.0 * i, 0}));
  }
  const SplitScene split = split_instances(s.scene);
  EXPECT_EQ(split.flattened_instances, kFlattenedPrimitives / (triangles * kUses) * kUses);
  EXPECT_EQ(split.instances.size(), 10 * kUses - split.flattened_instances);
  EXPECT_GT(split.instances.size(), 0u);
}

TEST(Instancing, AnObjectUsedOnceIsAsIfItsShapesWereThere) {
  TestScene s;
  const int o = begin_object(&s, "o");
  add_to_object(&s, o, MeshShape{ball_mesh(1, 16)}, s.diffuse(0.5f), scaling({1, 2, 3}));
  instance(&s, o, translation({0, 1, 5}) * rotation(20, {1, 0, 0}));
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene a = build_scene(s.scene), b = build_scene(flattened(s.scene));
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.normals, b.normals);
  EXPECT_EQ(a.scale_exponent, b.scale_exponent);
}

/// Two balls and a sphere in three instances of any kind, before a camera at the origin.
TestScene three_of(Random& random, bool similar) {
  TestScene s;
  const int grey = s.diffuse(0.5f), o = begin_object(&s, "o");
  s.scene.textures.push_back({"t", true, CheckerboardTexture{}, {}});
  std::get<DiffuseMaterial>(s.scene.materials.back().kind).reflectance.texture = 0;
  s.scene.materials.back().normal_map = 0;
  add_to_object(&s, o, MeshShape{ball_mesh(1, 64)}, grey);
  if (similar) add_to_object(&s, o, SphereShape{0.5f}, grey, translation({0, 1.8, 0}));
  for (int i = 0; i < 3; ++i) {
    const Vec3d at{-2.5 + 2.5 * i, 0, 6};
    instance(&s, o,
             similar ? translation(at) * rotation(random.between(0, 360), {1, 2, 3}) * scaling({-1, 1, 1})
                     : random_placement(random, at, 1.2));
  }
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  return s;
}

TEST(Instancing, SurfacesAreWhereFlatteningPutsThem) {
  Random random(3);
  for (int trial = 0; trial < 12; ++trial) {
    const TestScene s = three_of(random, trial % 2);
    const RenderScene a = build_scene(s.scene), b = build_scene(flattened(s.scene));
    ASSERT_EQ(a.instance_count(), 3);
    ASSERT_EQ(b.instance_count(), 0);
    ASSERT_TRUE(a.any_tangent);
    const Accel trace_a(a, 1), trace_b(b, 1);
    const float to_a = std::ldexp(1.0f, a.scale_exponent - b.scale_exponent);
    int hits = 0, same = 0;
    for (int ray = 0; ray < 3000; ++ray) {
      const Vec3<float> d = normalize(Vec3<float>{static_cast<float>(random.between(-0.7, 0.7)),
                                                  static_cast<float>(random.between(-0.5, 0.5)), 1});
      const Found fa = first_hit(trace_a, {}, d), fb = first_hit(trace_b, {}, d);
      EXPECT_EQ(fb.instance, -1);
      if (fa.prim < 0 || fb.prim < 0) continue;
      ++hits;
      const int32_t triangles = a.triangle_count();
      const int32_t in_b = fa.prim < triangles ? fa.instance * triangles + fa.prim
                                               : b.triangle_count() + fa.instance + fa.prim - triangles;
      if (in_b != fb.prim) continue;
      ++same;
      const Surface<float> sa = surface_at<float>(a, fa.prim, fa.instance, {}, d),
                           sb = surface_at<float>(b, fb.prim, {}, d);
      const auto near = [&](const Vec3<float>& x, const Vec3<float>& y, float scale, float error) {
        const Vec3<float> e = x - y * scale;
        return std::sqrt(dot(e, e)) <= error;
      };
      // At a glancing angle the hits slide along the surface.
      const float slide = 1 / std::max(std::fabs(dot(sb.ng, d)), 1e-3f);
      ASSERT_TRUE(near(sa.p, sb.p, to_a, 4e-6f * slide));
      ASSERT_TRUE(near(sa.ng, sb.ng, 1, 1e-4f * slide));
      ASSERT_TRUE(near(sa.ns, sb.ns, 1, 1e-4f * slide));
      ASSERT_NEAR(sa.u, sb.u, 1e-4f * slide);
      ASSERT_NEAR(sa.v, sb.v, 1e-4f * slide);
      const float size = std::sqrt(dot(sb.dpdu, sb.dpdu)) * to_a;
      ASSERT_TRUE(near(sa.dpdu, sb.dpdu, to_a, size * 1e-3f * slide));
      ASSERT_LT(sa.error, 1e-5f);
    }
    EXPECT_GT(hits, 200);
    EXPECT_GT(same, 0.99 * hits) << "only rays at edges may name another triangle";
  }
}

// Convex balls, of sizes from 1e-5 of their distance to about it, by matrices of all kinds.
TEST(Instancing, NoTriangleIsHitByTheRaysThatLeaveItsInstance) {
  Random random(4);
  int tested = 0;
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (int trial = 0; trial < 25; ++trial) {
      TestScene s;
      const int o = begin_object(&s, "o");
      const auto any = [&] { return random.between(-1, 1); };
      // The object itself lies anywhere in its space, at any scale.
      const double own = std::pow(10.0, random.between(-8, 8));
      add_to_object(&s, o, MeshShape{ball_mesh(1, 48)}, s.diffuse(0.5f),
                    scaling({own, own, own}) * translation({100 * any(), 0, 100 * any()}));
      const Transform back = inverse(s.scene.objects[0].shapes[0].object_to_world);
      for (int i = 0; i < 3; ++i) {
        const double size = scale * std::pow(10.0, random.between(-5, -0.5));
        instance(&s, o, random_placement(random, {scale * any(), scale * any(), scale * any()}, size) * back);
      }
      s.camera({scale * any(), scale * any(), scale * any()}, {0, 0, 0}, 60);
      const RenderScene scene = build_scene(s.scene);
      ASSERT_EQ(scene.instance_count(), 3);
      const Accel accel(scene, 1);
      for (int ray = 0; ray < 200; ++ray) {
        const auto which = static_cast<size_t>(ray % 3);
        const float* r = &scene.instance_records[which * kInstanceFloats];
        const float size = 1 / r[kInstanceTimeScale];  // A's largest entry is 1 to 2 of these
        const Vec3<float> d =
            normalize(Vec3<float>{r[kInstancePosition], r[kInstancePosition + 1], r[kInstancePosition + 2]} +
                      unit(random) * (size * 0.4f));
        const Found at = first_hit(accel, {}, d);
        if (at.prim < 0) continue;
        const Surface<float> hit = surface_at<float>(scene, at.prim, at.instance, {}, d);
        for (int k = 0; k < 10; ++k) {
          const Vec3<float> w = unit(random);
          if (std::fabs(dot(w, hit.ng)) < 1e-4f) continue;  // in the plane: there is no side
          const Vec3<float> from = offset_origin(hit.p, hit.error, hit.ng, w);
          const Found next = first_hit(accel, from, w);
          ASSERT_FALSE(next == at) << "scale " << scale << ", trial " << trial;
          ASSERT_EQ(blocked(accel, from, w, INFINITY), next.prim >= 0);
          ++tested;
        }
        // The bound is tight: a few ulps of the hit's distance from the camera and of the instance's size.
        const float far = std::sqrt(dot(hit.p, hit.p));
        ASSERT_LT(hit.error, 1e-5f * (far + size * r[kInstanceSpread]));
      }
    }
  }
  EXPECT_GT(tested, 20000);
}

// An axis in which the object has no extent does not count, however it is scaled.
TEST(Instancing, FlatObjectsMayBeStretchedAlongTheirNormals) {
  TestScene s;
  const int o = begin_object(&s, "o"), grey = s.diffuse(0.5f);
  TriangleMesh grid;
  constexpr uint32_t kCells = 8;
  for (uint32_t i = 0; i <= kCells; ++i) {
    for (uint32_t j = 0; j <= kCells; ++j)
      grid.positions.push_back({static_cast<float>(i) - 4, static_cast<float>(j) - 4, 3});
  }
  for (uint32_t i = 0; i < kCells; ++i) {
    for (uint32_t j = 0; j < kCells; ++j) {
      const uint32_t a = i * (kCells + 1) + j, b = a + kCells + 1;
      grid.triangles.push_back({a, b, b + 1});
      grid.triangles.push_back({a, b + 1, a + 1});
    }
  }
  add_to_object(&s, o, MeshShape{std::make_shared<TriangleMesh>(grid)}, grey);
  for (int i = 0; i < 2; ++i)
    instance(&s, o, translation({0, 0, 5.0 + i}) * scaling({0.5, 0.5, 1e6}) * translation({0, 0, -3}));
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  ASSERT_EQ(scene.instance_count(), 2);
  const Accel accel(scene, 1);
  Random random(7);
  for (int ray = 0; ray < 200; ++ray) {
    const Vec3<float> d = normalize(Vec3<float>{static_cast<float>(random.between(-0.3, 0.3)),
                                                static_cast<float>(random.between(-0.3, 0.3)), 1});
    const Found at = first_hit(accel, {}, d);
    ASSERT_EQ(at.instance, 0);
    const Surface<float> hit = surface_at<float>(scene, at.prim, at.instance, {}, d);
    ASSERT_LT(hit.error, 1e-5f * hit.p.z);
    const Vec3<float> w = unit(random);
    if (std::fabs(w.z) < 1e-3f) continue;
    ASSERT_NE(first_hit(accel, offset_origin(hit.p, hit.error, hit.ng, w), w).instance, 0);
  }
}

TEST(Instancing, TheSceneAtAnotherScaleHasTheSameBits) {
  Random random(5);
  const TestScene s = three_of(random, true);
  const RenderScene a = build_scene(s.scene);
  for (const int k : {-60, -7, 1, 30, 60}) {
    for (const SceneDescription& scaled : {scaled_scene(s.scene, k), scaled_vertices(s.scene, k)}) {
      const RenderScene b = build_scene(scaled);
      EXPECT_EQ(a.instance_records, b.instance_records) << k;
      EXPECT_EQ(a.positions, b.positions) << k;
      EXPECT_EQ(a.spheres, b.spheres) << k;
    }
  }
}

TEST(Instancing, LanesHaveTheBitsOfScalars) {
  Random random(6);
  TestScene s = three_of(random, true);
  s.quad({-9, -9, 8}, {0, 18, 0}, {18, 0, 0}, 0).sphere({0, 2.5, 6}, 0.8, 0);
  const RenderScene scene = build_scene(s.scene);
  const Accel accel(scene, 1);
  int mixed = 0;
  for (int group = 0; group < 500; ++group) {
    alignas(32) int32_t prim[8], instance[8];
    alignas(32) float dx[8], dy[8], dz[8];
    unsigned placed = 0;
    for (size_t l = 0; l < 8;) {
      const Vec3<float> d = normalize(Vec3<float>{static_cast<float>(random.between(-0.7, 0.7)),
                                                  static_cast<float>(random.between(-0.5, 0.5)), 1});
      const Found f = first_hit(accel, {}, d);
      if (f.prim < 0) continue;
      prim[l] = f.prim, instance[l] = f.instance;
      placed |= f.instance >= 0 ? 1u << l : 0;
      dx[l] = d.x, dy[l] = d.y, dz[l] = d.z;
      ++l;
    }
    mixed += placed != 0 && placed != 255;
    const Vec3<Float8> d{load<Float8>(dx), load<Float8>(dy), load<Float8>(dz)};
    const Surface<Float8> v =
        surface_at<Float8>(scene, load_int<Float8>(prim), load_int<Float8>(instance), {}, d);
    for (int l = 0; l < 8; ++l) {
      const Surface<float> g =
          surface_at<float>(scene, prim[l], instance[l], {}, Vec3<float>{dx[l], dy[l], dz[l]});
      for (const auto& [x, y] : {std::pair{&v.p, &g.p}, std::pair{&v.ng, &g.ng}, std::pair{&v.ns, &g.ns},
                                 std::pair{&v.dpdu, &g.dpdu}, std::pair{&v.dpdv, &g.dpdv}}) {
        ASSERT_EQ(float_bits(lane(x->x, l)), float_bits(y->x));
        ASSERT_EQ(float_bits(lane(x->y, l)), float_bits(y->y));
        ASSERT_EQ(float_bits(lane(x->z, l)), float_bits(y->z));
      }
      ASSERT_EQ(float_bits(lane(v.error, l)), float_bits(g.error));
      ASSERT_EQ(float_bits(lane(v.u, l)), float_bits(g.u));
    }
  }
  EXPECT_GT(mixed, 100);
}

}  // namespace
}  // namespace lightmill::test
