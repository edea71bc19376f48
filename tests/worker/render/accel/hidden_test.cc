// What is hidden from kinds of rays is not there for them: meshes, spheres and instances, one ray and many.
#include <gtest/gtest.h>

#include "tests/support/test_scene.h"
#include "worker/render/accel/accel.h"

namespace lightmill::test {
namespace {

/// From the origin along +z: a square at 1, a ball around 3, an instanced square at 5 and a wall at 9.
SceneDescription in_a_row(RayKinds mesh, RayKinds ball, RayKinds instance) {
  TestScene s;
  const int grey = s.diffuse(0.5f);
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  s.quad({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, grey);
  s.sphere({0, 0, 3}, 0.5, grey);
  s.quad({-1, -1, 9}, {0, 2, 0}, {2, 0, 0}, grey);
  s.quad({-1, -1, 0}, {0, 2, 0}, {2, 0, 0}, grey);
  SceneDescription& d = s.scene;
  d.shapes[0].hidden = mesh;
  d.shapes[1].hidden = ball;
  d.objects.push_back({"square", {d.shapes.back()}});
  d.shapes.pop_back();
  // Enough of them that they stay instances.
  for (int i = 0; i < 40000; ++i) d.instances.push_back({0, -1, translation({10.0 + i, 0, 5}), instance});
  d.instances.push_back({0, -1, translation({0, 0, 5}), instance});
  return d;
}

/// The distance that each of `count` rays of `kinds` goes.
void expect_distance(const SceneDescription& description, RayKinds kinds, float distance) {
  const RenderScene scene = build_scene(description);
  ASSERT_TRUE(scene.any_instances());
  const Accel accel(scene, 1);
  const float unit = std::ldexp(1.0f, scene.scale_exponent);
  for (const int count : {1, 5, 8}) {
    std::vector<TracedRay> rays(8, TracedRay{{0.01f * unit, 0.02f * unit, 0}, {0, 0, 1}, -1, -1});
    const std::vector<int32_t> ids{0, 1, 2, 3, 4, 5, 6, 7};
    const std::vector<RayKinds> of(8, kinds);
    accel.closest_hits(rays.data(), ids.data(), count, nullptr, {of.data()});
    for (const float part : {0.9f, 1.1f}) {
      std::vector<float> ox(8, 0.01f * unit), oy(8, 0.02f * unit), zero(8, 0.0f), one(8, 1.0f),
          far(8, distance * part * unit);
      std::vector<uint8_t> stopped(8);
      accel.occluded({ox.data(), oy.data(), zero.data(), zero.data(), zero.data(), one.data()}, far.data(),
                     count, stopped.data(), nullptr, kinds);
      for (int i = 0; i < count; ++i) EXPECT_EQ(stopped[static_cast<size_t>(i)], part > 1) << distance;
    }
    for (int i = 0; i < count; ++i) EXPECT_GE(rays[static_cast<size_t>(i)].prim, 0);
  }
}

TEST(HiddenTest, RaysGoOnThroughWhatTheyDoNotSee) {
  expect_distance(in_a_row(0, 0, 0), kCameraRays, 1);
  expect_distance(in_a_row(kCameraRays, 0, 0), kCameraRays, 2.5f);
  expect_distance(in_a_row(kCameraRays, 0, 0), kShadowRays, 1);
  expect_distance(in_a_row(kCameraRays, kCameraRays | kGlossyRays, 0), kGlossyRays, 1);
  expect_distance(in_a_row(kCameraRays, kCameraRays | kGlossyRays, 0), kCameraRays, 5);
  expect_distance(in_a_row(kAllRays, kAllRays, kDiffuseRays), kDiffuseRays, 9);
  expect_distance(in_a_row(kAllRays, kAllRays, kDiffuseRays), kCameraRays, 5);
}

// A ray of two kinds sees what either sees.
TEST(HiddenTest, ARayOfTwoKindsSeesWhatEitherSees) {
  expect_distance(in_a_row(kDiffuseRays, 0, 0), kDiffuseRays | kVolumeRays, 1);
  expect_distance(in_a_row(kDiffuseRays | kVolumeRays, 0, 0), kDiffuseRays | kVolumeRays, 2.5f);
}

}  // namespace
}  // namespace lightmill::test
