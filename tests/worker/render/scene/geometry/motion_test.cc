// Moving instances and shapes: at every time they are where a scene that stands still at that time has them,
// to rays and to surfaces; boxes hold them; rays that leave them do not meet them again.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/instanced_scene.h"
#include "tests/support/random_direction.h"
#include "tests/support/scaled_scene.h"
#include "tests/support/statistics.h"
#include "worker/render/accel/accel.h"
#include "worker/render/scene/geometry/instancing.h"
#include "worker/render/scene/geometry/surface.h"

namespace lightmill::test {
namespace {

struct MovingHit {
  int32_t prim = -1, instance = -1;
  bool operator==(const MovingHit&) const = default;
};
MovingHit first_moving_hit(const Accel& accel, const Vec3<float>& o, const Vec3<float>& d, float time) {
  const int32_t id = 0;
  TracedRay ray{{o.x, o.y, o.z}, {d.x, d.y, d.z}, -1, -1};
  accel.closest_hits(&ray, &id, 1, &time);
  return {ray.prim, ray.instance};
}
bool moving_blocked(const Accel& accel, const Vec3<float>& o, const Vec3<float>& d, float time) {
  uint8_t hit = 0;
  const float tfar = INFINITY;
  accel.occluded({&o.x, &o.y, &o.z, &d.x, &d.y, &d.z, &time}, &tfar, 1, &hit);
  return hit;
}

Transform any_turn(Random& random) {
  return rotation(random.between(0, 360),
                  {random.between(0.1, 1), random.between(-1, 1), random.between(-1, 1)});
}

/// What a ball becomes that is twisted about z and pressed, by `much`.
std::shared_ptr<const TriangleMesh> twisting_ball(int segments, double much) {
  return bending(*ball_mesh(1, segments), 8, [=](const Vec3f& p, double time) {
    const double angle = much * time * (0.5 + double{p.z}), c = std::cos(angle), s = std::sin(angle);
    return Vec3f{static_cast<float>(c * p.x - s * p.y), static_cast<float>(s * p.x + c * p.y),
                 static_cast<float>(p.z * (1 - 0.4 * much * time * (1 - time)))};
  });
}

/// A ball that moves and turns, a sphere, an instance of a ball whose own part moves, a still ball, and two
/// that bend, of which one moves, too.
TestScene moving_things(Random& random) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  s.scene.textures.push_back({"t", true, CheckerboardTexture{}, {}});
  std::get<DiffuseMaterial>(s.scene.materials.back().kind).reflectance.texture = 0;
  s.scene.materials.back().normal_map = 0;
  const MeshShape ball{ball_mesh(1, 48)};
  const auto at = [&] {
    return translation({random.between(-2, 2), random.between(-1.5, 1.5), random.between(5, 9)});
  };
  const auto shape = [&](ShapeKind kind, const Transform& start, const Transform& end) {
    ShapeDescription& d = s.scene.shapes.emplace_back();
    d.kind = std::move(kind);
    d.material = grey;
    d.object_to_world = start;
    if (start.m != end.m) d.moves_to = ends_at(&s, end);
  };
  shape(ball, at() * any_turn(random) * scaling({1, 0.4, 0.6}),
        at() * any_turn(random) * scaling({0.5, 0.7, 1}));
  shape(SphereShape{0.7f}, at() * scaling({-1, 1, 1}), at() * any_turn(random) * scaling({-1.3, 1.3, 1.3}));
  const Transform stays = at();
  shape(ball, stays, stays);
  const MeshShape bends{twisting_ball(48, 1)};
  const Transform bent = at() * any_turn(random) * scaling({1.2, 0.5, 0.8});
  shape(bends, bent, bent);
  shape(bends, at() * any_turn(random), at() * any_turn(random));
  const int o = begin_object(&s, "o");
  add_to_object(&s, o, ball, grey, scaling({0.5, 0.5, 0.5}));
  ShapeDescription& part =
      add_to_object(&s, o, ball, grey, translation({1, 0, 0}) * scaling({0.3, 0.3, 0.3}));
  part.moves_to = ends_at(&s, rotation(120, {0, 0, 1}) * translation({1, 0, 0}) * scaling({0.3, 0.3, 0.3}));
  instance(&s, o, at() * any_turn(random));
  s.scene.instances.back().moves_to = ends_at(&s, at() * any_turn(random));
  instance(&s, o, at());
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  return s;
}

Vec3<float> view(Random& random) {
  return normalize(Vec3<float>{static_cast<float>(random.between(-0.5, 0.5)),
                               static_cast<float>(random.between(-0.4, 0.4)), 1});
}

TEST(Motion, IsBuiltOfWaysThatLookRound) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  const auto moving = [&](const Transform& end, const Transform& start = {}) {
    ShapeDescription& d = s.scene.shapes.emplace_back();
    d.kind = MeshShape{ball_mesh(1, 8)};
    d.material = grey;
    d.object_to_world = start;
    d.moves_to = ends_at(&s, end);
  };
  moving(translation({9, 0, 0}));
  moving(scaling({2, 3, 4}));
  moving(rotation(2, {0, 1, 0}));
  moving(rotation(90, {0, 1, 0}));
  moving(rotation(179, {0, 1, 0}));
  s.scene.shapes.push_back(s.scene.shapes.back());  // moves along
  const SplitScene split = split_instances(s.scene);
  ASSERT_EQ(split.objects.size(), 5u);
  EXPECT_EQ(split.objects[4].shapes.size(), 2u);
  ASSERT_EQ(split.ways.size(), 5u);
  const size_t poses[] = {2, 2, 2, 65, 129};
  for (size_t i = 0; i < 5; ++i) EXPECT_EQ(split.ways[i].size(), poses[i]) << i;
  s.camera({0, 0, -5}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  EXPECT_EQ(scene.instance_count(), 5);
  EXPECT_EQ(scene.first_moving, 0);
  EXPECT_TRUE(scene.moves());
  EXPECT_FALSE(build_scene(still_at(s.scene, 0)).moves());
}

TEST(Motion, WhatBendsIsAnObjectOfItsOwnWithABoxAroundAllSteps) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  const auto grows = bending(*ball_mesh(1, 16), 2, [](const Vec3f& p, double time) {
    const auto f = static_cast<float>(1 + 4 * time);
    return Vec3f{p.x * f, p.y, p.z};
  });
  const auto add = [&](const Transform& at) {
    ShapeDescription& d = s.scene.shapes.emplace_back();
    d.kind = MeshShape{grows};
    d.material = grey;
    d.object_to_world = at;
  };
  add(translation({1, 2, 3}));
  add(translation({1, 2, 3}));
  add(translation({9, 2, 3}));
  const SplitScene split = split_instances(s.scene);
  ASSERT_EQ(split.objects.size(), 2u) << "those in one place go together";
  EXPECT_EQ(split.objects[0].shapes.size(), 2u);
  EXPECT_NEAR(split.objects[0].lo[0], -5, 0.2);
  EXPECT_NEAR(split.objects[0].hi[1], 1, 0.2);
  s.camera({0, 0, -5}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  EXPECT_TRUE(scene.moves());
  EXPECT_EQ(scene.bends.size(), 4u);
  EXPECT_EQ(scene.triangle_bend.size(), static_cast<size_t>(scene.triangle_count()));
  EXPECT_FALSE(build_scene(still_at(s.scene, 0.5)).any_bending());
}

TEST(Motion, EmittersAreWhereTheirTrianglesAre) {
  Random random(8);
  TestScene s;
  s.scene.area_lights.push_back({{1, 1, 1}});
  const int grey = s.diffuse(0.5f);
  const auto add = [&](const std::shared_ptr<const TriangleMesh>& mesh, const Transform& start,
                       const Transform& end) {
    ShapeDescription d;
    d.kind = MeshShape{mesh};
    d.material = grey;
    d.area_light = 0;
    d.object_to_world = start;
    if (start.m != end.m) d.moves_to = ends_at(&s, end);
    return d;
  };
  const auto place = [&] {
    return translation({random.between(-2, 2), random.between(-2, 2), random.between(5, 9)}) *
           any_turn(random) * scaling({-0.5, 1, 0.7});
  };
  const Transform at = place();
  s.scene.shapes.push_back(add(ball_mesh(1, 8), place(), place()));
  s.scene.shapes.push_back(add(twisting_ball(8, 1), at, at));
  s.scene.shapes.push_back(add(twisting_ball(8, 1), place(), place()));
  const int o = begin_object(&s, "o");
  s.scene.objects.back().shapes.push_back(
      add(ball_mesh(1, 8), scaling({0.5, 0.5, 0.5}), scaling({0.5, 0.5, 0.5})));
  for (int i = 0; i < 2; ++i) {
    instance(&s, o, place());
    s.scene.instances.back().moves_to = ends_at(&s, place());
  }
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  ASSERT_EQ(scene.ways.size(), 5u);
  ASSERT_TRUE(scene.lights.any_moving());
  for (const float time : {0.0f, 0.3f, 0.5f, 1.0f}) {
    double power = 0, still_power = 0;
    const RenderScene still = build_scene(still_at(s.scene, double{time}));
    for (int32_t prim = 0; prim < scene.triangle_count(); ++prim) {
      const int32_t light = scene.primitive_light[static_cast<size_t>(prim)];
      ASSERT_GE(light, 0);
      float r[kLightFloats];
      scene.lights.record_at(light, time, r);
      power += double{r[kLightArea]};
      // A ray that comes from before the triangle's middle meets it there, from the side that shines.
      const Vec3<float> middle{r[0] + (r[3] + r[6]) / 3, r[1] + (r[4] + r[7]) / 3, r[2] + (r[5] + r[8]) / 3};
      const Vec3<float> n{r[9], r[10], r[11]};
      int32_t instance = 0;
      for (int32_t i = 0; i < scene.instance_count(); ++i) {
        const ObjectRange& range =
            scene.objects[static_cast<size_t>(scene.instance_object[static_cast<size_t>(i)])];
        const MeshRange& mesh = scene.meshes[range.first_mesh];
        if (prim >= mesh.first_triangle && prim < mesh.first_triangle + mesh.triangle_count) instance = i;
      }
      const Surface<float> hit = surface_at<float>(scene, prim, instance, middle + n * 0.25f, -n, time);
      const Vec3<float> off = hit.p - middle;
      EXPECT_LT(std::sqrt(dot(off, off)), 2e-4f) << prim << " at " << time;
      EXPECT_GT(dot(hit.ng, n), 0.999f) << prim;
    }
    for (int32_t i = 0; i < still.lights.count(); ++i)
      still_power += double{still.lights.records[static_cast<size_t>(i) * kLightFloats + kLightArea]};
    const double units = std::ldexp(1.0, 2 * (scene.scale_exponent - still.scale_exponent));
    EXPECT_NEAR(power, still_power * units, 2e-3 * power);
  }
}

TEST(Motion, SurfacesAreWhereAStillSceneHasThem) {
  Random random(3);
  for (int trial = 0; trial < 10; ++trial) {
    const TestScene s = moving_things(random);
    const RenderScene a = build_scene(s.scene);
    ASSERT_EQ(a.ways.size(), 7u);
    ASSERT_EQ(a.bends.size(), 3u);
    const Accel trace_a(a, 1);
    for (const float time : {0.0f, 0.125f, 0.5f, 0.7390625f, 1.0f}) {
      const RenderScene b = build_scene(flattened(still_at(s.scene, double{time})));
      const Accel trace_b(b, 1, Structure::kTree);
      const float to_a = std::ldexp(1.0f, a.scale_exponent - b.scale_exponent);
      int hits = 0, same = 0;
      for (int ray = 0; ray < 400; ++ray) {
        const Vec3<float> d = view(random);
        const MovingHit fa = first_moving_hit(trace_a, {}, d, time), fb = first_moving_hit(trace_b, {}, d, 0);
        if (fa.prim < 0 && fb.prim < 0) continue;
        ++hits;
        if (fa.prim < 0 || fb.prim < 0) continue;  // beside an edge that is a ten-thousandth off
        const Surface<float> sa = surface_at<float>(a, fa.prim, fa.instance, {}, d, time),
                             sb = surface_at<float>(b, fb.prim, {}, d);
        const Vec3<float> apart = sa.p - sb.p * to_a, turned = sa.ns - sb.ns;
        const float slide = 1 / std::max(std::fabs(dot(sb.ng, d)), 1e-2f);
        // Ways are within 1e-4 of the objects' sizes; normals within the turn of a segment.
        if (std::sqrt(dot(apart, apart)) > 4e-4f * to_a * 2 * slide) continue;
        EXPECT_LT(std::sqrt(dot(turned, turned)), 0.05f * slide);
        EXPECT_GT(dot(sa.ng, sb.ng), 0.9f);
        ++same;
      }
      EXPECT_GT(hits, 20) << "things may stand in each other's way";
      EXPECT_GT(same, 0.97 * hits) << "trial " << trial << ", time " << time;
    }
  }
}

// At any time, of sizes from 1e-5 of the distance on.
TEST(Motion, NoTriangleIsHitByTheRaysThatLeaveIt) {
  Random random(4);
  int tested = 0;
  for (const double scale : {1e-6, 1.0, 1e6}) {
    for (int trial = 0; trial < 15; ++trial) {
      TestScene s;
      const int grey = s.diffuse(0.5f);
      for (int i = 0; i < 3; ++i) {
        const double size = scale * std::pow(10.0, random.between(-4, -0.5));
        const auto place = [&] {
          return translation({scale * random.between(-1, 1), scale * random.between(-1, 1),
                              scale * random.between(-1, 1)}) *
                 any_turn(random) * scaling({size, size * random.between(0.3, 1), size});
        };
        ShapeDescription& d = s.scene.shapes.emplace_back();
        d.kind = MeshShape{i == 1 ? ball_mesh(1, 32) : twisting_ball(32, 1)};
        d.material = grey;
        d.object_to_world = place();
        d.moves_to = ends_at(&s, place());
      }
      s.camera({scale * random.between(-1, 1), 0, 0}, {0, 0, 0}, 60);
      const RenderScene scene = build_scene(s.scene);
      ASSERT_EQ(scene.ways.size(), 3u);
      const Accel accel(scene, 1);
      for (int ray = 0; ray < 150; ++ray) {
        const auto which = static_cast<int32_t>(ray % 3);
        const float time = random.uniform();
        float r[kInstanceFloats];
        record_at(scene, which, time, r);
        const Vec3<float> d =
            normalize(Vec3<float>{r[kInstancePosition], r[kInstancePosition + 1], r[kInstancePosition + 2]} +
                      unit(random) * (0.2f / r[kInstanceTimeScale]));
        const MovingHit at = first_moving_hit(accel, {}, d, time);
        if (at.prim < 0) continue;
        const Surface<float> hit = surface_at<float>(scene, at.prim, at.instance, {}, d, time);
        for (int k = 0; k < 8; ++k) {
          const Vec3<float> w = unit(random);
          if (std::fabs(dot(w, hit.ng)) < 1e-4f) continue;  // in the plane: there is no side
          const Vec3<float> from = offset_origin(hit.p, hit.error, hit.ng, w);
          const MovingHit next = first_moving_hit(accel, from, w, time);
          ASSERT_FALSE(next == at) << "scale " << scale << ", trial " << trial;
          ASSERT_EQ(moving_blocked(accel, from, w, time), next.prim >= 0);
          ++tested;
        }
      }
    }
  }
  EXPECT_GT(tested, 8000);
}

TEST(Motion, LanesHaveTheBitsOfScalars) {
  Random random(6);
  TestScene s = moving_things(random);
  s.quad({-9, -9, 12}, {0, 18, 0}, {18, 0, 0}, 0);
  const RenderScene scene = build_scene(s.scene);
  const Accel accel(scene, 1);
  for (int group = 0; group < 300; ++group) {
    alignas(32) int32_t prim[8], instance[8];
    alignas(32) float dx[8], dy[8], dz[8], time[8];
    for (size_t l = 0; l < 8; ++l) {
      const Vec3<float> d = view(random);
      time[l] = random.uniform();
      const MovingHit f = first_moving_hit(accel, {}, d, time[l]);
      ASSERT_GE(f.prim, 0);
      prim[l] = f.prim, instance[l] = f.instance;
      dx[l] = d.x, dy[l] = d.y, dz[l] = d.z;
    }
    const Vec3<Float8> d{load<Float8>(dx), load<Float8>(dy), load<Float8>(dz)};
    const Surface<Float8> v = surface_at<Float8>(scene, load_int<Float8>(prim), load_int<Float8>(instance),
                                                 {}, d, load<Float8>(time));
    for (int l = 0; l < 8; ++l) {
      const Surface<float> g =
          surface_at<float>(scene, prim[l], instance[l], {}, Vec3<float>{dx[l], dy[l], dz[l]}, time[l]);
      for (const auto& [x, y] : {std::pair{&v.p, &g.p}, std::pair{&v.ng, &g.ng}, std::pair{&v.ns, &g.ns},
                                 std::pair{&v.dpdu, &g.dpdu}}) {
        ASSERT_EQ(float_bits(lane(x->x, l)), float_bits(y->x));
        ASSERT_EQ(float_bits(lane(x->y, l)), float_bits(y->y));
        ASSERT_EQ(float_bits(lane(x->z, l)), float_bits(y->z));
      }
      ASSERT_EQ(float_bits(lane(v.error, l)), float_bits(g.error));
    }
  }
}

TEST(Motion, TheSceneReachesAsFarAsThingsMove) {
  TestScene s;
  ShapeDescription& d = s.scene.shapes.emplace_back();
  d.kind = SphereShape{1};
  d.material = s.diffuse(0.5f);
  d.object_to_world = translation({-3, 0, 5});
  d.moves_to = ends_at(&s, translation({40, 0, 5}));
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  const double reach =
      std::ldexp(double{scene.bounds_center[0]} + scene.bounds_radius, -scene.scale_exponent);
  EXPECT_GE(reach, 41);
  EXPECT_LT(reach, 45);
}

TEST(Motion, WhatIsNearlyFlatStaysAndIsNamed) {
  TestScene s;
  ShapeDescription& d = s.scene.shapes.emplace_back();
  d.kind = MeshShape{ball_mesh(1, 8)};
  d.material = s.diffuse(0.5f);
  d.object_to_world = translation({0, 0, 5});
  d.moves_to = ends_at(
      &s, translation({0, 0, 5}) * rotation(45, {1, 1, 0}) * scaling({1, 1, 1e-7}) * rotation(30, {0, 1, 1}));
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  EXPECT_FALSE(scene.moves());
  EXPECT_EQ(scene.instance_count(), 0);
  EXPECT_GT(scene.triangle_count(), 0);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].message.find("stays as at its start time"), std::string::npos);
}

TEST(Motion, TheSceneAtAnotherScaleHasTheSameBits) {
  Random random(5);
  const TestScene s = moving_things(random);
  const RenderScene a = build_scene(s.scene);
  for (const int k : {-60, -7, 1, 30, 60}) {
    const RenderScene b = build_scene(scaled_scene(s.scene, k));
    EXPECT_EQ(a.poses, b.poses) << k;
    EXPECT_EQ(a.instance_records, b.instance_records) << k;
  }
}

}  // namespace
}  // namespace lightmill::test
