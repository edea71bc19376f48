// Faces that coincide are found and set apart; nothing else moves.
#include "worker/render/scene/coincidence/coincident_faces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "tests/support/instanced_scene.h"
#include "tests/support/scaled_scene.h"
#include "tests/support/statistics.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {
namespace {

/// Meshes as the scene builder places them, in a space with the viewer at the origin.
struct Placed {
  std::vector<std::shared_ptr<const TriangleMesh>> meshes;
  std::vector<PlacedMesh> placed;
  std::vector<SurfaceTraits> traits;
  std::vector<float> positions;

  SurfaceTraits& add(TriangleMesh mesh, bool passes = false) {
    meshes.push_back(std::make_shared<TriangleMesh>(std::move(mesh)));
    placed.push_back({meshes.back().get(), positions.size() / 3, 0});
    for (const Vec3f& p : meshes.back()->positions) positions.insert(positions.end(), {p.x, p.y, p.z});
    SurfaceTraits& t = traits.emplace_back();
    t.passes = passes;
    t.material = static_cast<int>(traits.size());
    return t;
  }
  CoincidentFaces separate() { return separate_faces(placed, traits, nullptr, {}, positions.data()); }
  /// Lowest and highest z of a mesh.
  std::pair<float, float> depth(size_t mesh) const {
    float lo = HUGE_VALF, hi = -HUGE_VALF;
    for (size_t v = 0; v < meshes[mesh]->positions.size(); ++v) {
      const float z = positions[3 * (placed[mesh].first_vertex + v) + 2];
      lo = std::min(lo, z), hi = std::max(hi, z);
    }
    return {lo, hi};
  }
};

/// A square in the plane z that faces the viewer, of n x n cells.
TriangleMesh square(float half, float z, float x = 0, int n = 1) {
  TriangleMesh m;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const auto at = [&](int k) { return half * (2 * static_cast<float>(k) / static_cast<float>(n) - 1); };
      m.positions.push_back({x + at(i), at(j), z});
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const auto v = [&](int a, int b) { return static_cast<uint32_t>((i + a) * (n + 1) + j + b); };
      m.triangles.push_back({v(0, 0), v(0, 1), v(1, 1)});
      m.triangles.push_back({v(0, 0), v(1, 1), v(1, 0)});
    }
  }
  return m;
}
/// A closed box over a square, from z to z + height, its normals outwards.
TriangleMesh box(float half, float z, float height, float x = 0) {
  TriangleMesh m;
  for (int c = 0; c < 8; ++c)
    m.positions.push_back({x + (c & 1 ? half : -half), c & 2 ? half : -half, c & 4 ? z + height : z});
  const uint32_t sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 4, 6, 2},
                                {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}};
  for (const auto& q : sides) m.triangles.insert(m.triangles.end(), {{q[0], q[1], q[2]}, {q[0], q[2], q[3]}});
  return m;
}

constexpr float kStep = 64 * 0x1p-24f;  // over the largest coordinate

TEST(CoincidentFaces, BodiesThatTouchGetAGap) {
  Placed p;
  p.add(box(0.5f, 1, 0.25f), true);
  p.add(box(0.5f, 1.25f, 0.25f), true);
  EXPECT_EQ(p.separate().faces, 4u);
  EXPECT_EQ(p.depth(0), (std::pair(1.0f, 1.25f)));
  EXPECT_NEAR(p.depth(1).first, 1.25f + 1.25f * kStep, 1.25f * kStep / 8);
  EXPECT_EQ(p.depth(1).second, 1.5f);
}

TEST(CoincidentFaces, FacesThatOverlapInPartAndOfOtherTriangles) {
  for (const int n : {1, 7, 40}) {
    Placed p;
    p.add(square(0.5f, 1, 0.3f, n));
    p.add(square(0.5f, 1, 0, 3));
    EXPECT_GT(p.separate().faces, 0u);
    // Equal size: the later one is in front, where it overlaps.
    float nearest = 1;
    for (size_t v = 0; v < p.positions.size(); v += 3) nearest = std::min(nearest, p.positions[v + 2]);
    EXPECT_NEAR(nearest, 1 - kStep, kStep / 8) << n;
    EXPECT_EQ(p.depth(0), (std::pair(1.0f, 1.0f)));
  }
}

TEST(CoincidentFaces, TheInnerBodyIsTheSmallerOne) {
  Placed p;
  p.add(box(0.5f, 1, 0.5f), true);
  p.add(box(0.25f, 1, 0.25f), true);
  EXPECT_EQ(p.separate().faces, 4u);
  EXPECT_EQ(p.depth(0).first, 1.0f);
  EXPECT_GT(p.depth(1).first, 1 + kStep / 2);
}

TEST(CoincidentFaces, ADecalLiesBeforeItsWallWhateverItsWinding) {
  for (const bool turned : {false, true}) {
    Placed p;
    TriangleMesh decal = square(0.25f, 1);
    if (turned) {
      for (auto& t : decal.triangles) std::swap(t[0], t[1]);
    }
    p.add(decal);
    p.add(square(1, 1));
    EXPECT_EQ(p.separate().faces, 4u);
    EXPECT_LT(p.depth(0).second, 1 - kStep / 2);
    EXPECT_EQ(p.depth(1), (std::pair(1.0f, 1.0f)));
  }
}

TEST(CoincidentFaces, WhatIsTheSameInAllRespectsIsThereOnce) {
  Placed p;
  p.add(box(0.5f, 1, 0.5f)).material = 0;
  p.add(box(0.5f, 1, 0.5f)).material = 0;
  const std::vector<float> before = p.positions;
  const CoincidentFaces found = p.separate();
  EXPECT_EQ(found.faces, 24u);
  ASSERT_EQ(found.left_out.size(), 12u);
  EXPECT_EQ(found.left_out.front(), (FaceId{1, 0}));
  EXPECT_EQ(p.positions, before);
}

TEST(CoincidentFaces, AllCornersOfABodyMoveOutwards) {
  Placed p;
  p.add(*ball_mesh(0.5, 16), true);
  p.add(*ball_mesh(0.5, 16), true);
  EXPECT_GT(p.separate().faces, 0u);
  const size_t n = p.positions.size() / 2;
  for (size_t v = 0; v < n; v += 3) {
    const float *a = &p.positions[v], *b = &p.positions[n + v];
    EXPECT_GT(std::hypot(b[0], b[1], b[2]) - std::hypot(a[0], a[1], a[2]), kStep / 4) << v;
  }
}

TEST(CoincidentFaces, OpaqueBodiesThatTouchStay) {
  Placed p;
  p.add(box(0.5f, 1, 0.25f));
  p.add(box(0.5f, 1.25f, 0.25f));
  p.add(box(0.25f, 1.5f, 0.25f));
  const std::vector<float> before = p.positions;
  EXPECT_EQ(p.separate().faces, 0u);
  EXPECT_EQ(p.positions, before);
}

TEST(CoincidentFaces, NothingMovesWhereFacesShareEdgesOrCross) {
  Random random(3);
  Placed p;
  p.add(square(0.25f, 1, -0.25f, 5), true);
  p.add(square(0.25f, 1, 0.25f, 3), true);   // beside it
  p.add(square(0.25f, 1.001f, 0, 3), true);  // behind it
  for (int i = 0; i < 200; ++i) {
    TriangleMesh m;
    for (int k = 0; k < 3; ++k) {
      const auto at = [&] { return static_cast<float>(random.between(-1, 1)); };
      m.positions.push_back({at(), at(), at()});
    }
    m.triangles = {{0, 1, 2}};
    p.add(m, true);
  }
  const std::vector<float> before = p.positions;
  const CoincidentFaces found = p.separate();
  EXPECT_EQ(found.faces, 0u);
  EXPECT_TRUE(found.shapes.empty());
  EXPECT_EQ(p.positions, before);
}

TEST(CoincidentFaces, ThreadsDoNotShow) {
  Placed p;
  for (int i = 0; i < 20; ++i)
    p.add(square(0.4f, 1, 0.01f * static_cast<float>(i % 7), 5 + i % 11), i % 2 == 0);
  const std::vector<FacePair> one = overlapping_faces(p.placed, p.positions.data(), 1),
                              four = overlapping_faces(p.placed, p.positions.data(), 4);
  ASSERT_EQ(one.size(), four.size());
  for (size_t i = 0; i < one.size(); ++i) EXPECT_TRUE(one[i].a == four[i].a && one[i].b == four[i].b);
}

TEST(CoincidentFaces, TheWorkForManyInOnePlaceIsBounded) {
  constexpr int kCount = 20000;
  Placed p;
  for (int i = 0; i < kCount; ++i) p.add(square(0.4f, 1, 1e-5f * static_cast<float>(i % 1000)));
  const size_t pairs = overlapping_faces(p.placed, p.positions.data(), 0).size();
  EXPECT_GT(pairs, size_t{kCount});
  EXPECT_LT(pairs, size_t{kCount} * 32 + (1 << 20));
  p.separate();
  const auto [nearest, farthest] = std::pair(p.depth(kCount - 1).first, p.depth(0).second);
  EXPECT_GT(nearest, 1 - 100 * kStep);
  EXPECT_LT(farthest, 1 + 100 * kStep);
}

TEST(CoincidentFaces, ScaleDoesNotShow) {
  TestScene s;
  const int grey = s.diffuse(0.5f), glass = s.dielectric(1.5f, 0);
  s.box({-1, -1, 2}, {1, 1, 3}, glass).box({-1, -1, 3}, {1, 1, 4}, glass);
  s.quad({-3, -3, 4.5}, {6, 0, 0}, {0, 6, 0}, grey).quad({-1, -1, 4.5}, {2, 0, 0}, {0, 2, 0}, glass);
  s.sphere({0, 0, 6}, 1, glass).sphere({0, 0, 6}, 1, grey);
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].message.find("8 faces and 2 spheres of 6 shapes coincide"), std::string::npos)
      << scene.warnings[0].message;
  for (const int k : {-20, 20}) {
    const RenderScene other = build_scene(scaled_scene(s.scene, k));
    EXPECT_EQ(other.positions, scene.positions);
    EXPECT_EQ(other.spheres, scene.spheres);
  }
}

TEST(CoincidentFaces, SpheresInOnePlace) {
  TestScene s;
  const int grey = s.diffuse(0.5f), glass = s.dielectric(1.5f, 0);
  s.sphere({0, 0, 4}, 1, glass)
      .sphere({0, 0, 4}, 1, grey)
      .sphere({0, 0, 4}, 1, grey)
      .sphere({0, 0, 9}, 1, grey);
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  ASSERT_EQ(scene.sphere_count(), 3);
  // The glass is around what is solid, which stays where there is but that.
  EXPECT_GT(scene.spheres[3], scene.spheres[7]);
  EXPECT_EQ(scene.spheres[11], scene.spheres[3] < scene.spheres[11] ? scene.spheres[11] : scene.spheres[3]);
}

TEST(CoincidentFaces, EmittersShineFromWhereTheyCameToLie) {
  TestScene s;
  s.quad({-2, -2, 4}, {0, 4, 0}, {4, 0, 0}, s.diffuse(0.5f));
  s.quad({-1, -1, 4}, {0, 2, 0}, {2, 0, 0}, s.diffuse(0.5f), {.radiance = {1, 1, 1}});
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  ASSERT_EQ(scene.lights.count(), 2);
  const float wall = scene.positions[2], lamp = scene.positions[14];
  EXPECT_LT(lamp, wall);
  EXPECT_EQ(scene.lights.records[kLightP + 2], lamp);
}

TEST(CoincidentFaces, InstancedObjects) {
  TestScene s;
  const int grey = s.diffuse(0.5f), glass = s.dielectric(1.5f, 0);
  const int o = begin_object(&s, "o");
  add_to_object(&s, o, MeshShape{ball_mesh(1, 32)}, grey);
  add_to_object(&s, o, MeshShape{ball_mesh(1, 32)}, glass);
  for (int i = 0; i < 8; ++i) instance(&s, o, translation({3.0 * i, 0, 5}));
  s.camera({0, 0, 0}, {0, 0, 1}, 60);
  const RenderScene scene = build_scene(s.scene);
  ASSERT_TRUE(scene.any_instances());
  ASSERT_EQ(scene.warnings.size(), 1u);
  const size_t n = (scene.positions.size() - 4) / 2;
  float least = HUGE_VALF, most = 0;
  for (size_t v = 0; v < n; v += 3) {
    const auto size = [&](size_t k) {
      return std::hypot(scene.positions[k], scene.positions[k + 1], scene.positions[k + 2]);
    };
    least = std::min(least, size(n + v) - size(v));
    most = std::max({most, std::fabs(scene.positions[v]), std::fabs(scene.positions[n + v])});
  }
  EXPECT_GT(least, 16 * 0x1p-24f);
  for (int k = 0; k < 3; ++k) EXPECT_GE(scene.objects[0].hi[k], most);
}

}  // namespace
}  // namespace lightmill::test
