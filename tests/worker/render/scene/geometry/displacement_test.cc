// Displaced meshes: heights in closed form, no gaps, bounds.
#include "worker/render/scene/geometry/displacement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

using Place = std::array<float, 3>;
Place place(const Vec3f& p) { return {p.x, p.y, p.z}; }

/// A square of side 2 in the plane z = 0, u along x, v along y, with normals if asked; its height is `height`
/// u.
SceneDescription square(float height, float edge_length, bool normals) {
  TestScene s;
  TextureDescription ramp;
  ramp.is_spectrum = false;
  ramp.kind = BilerpTexture{{}, {}, {height, height, height}, {height, height, height}, {}};
  s.scene.textures.push_back(ramp);
  s.quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, s.diffuse(0.5f));
  TriangleMesh mesh;
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  if (normals) mesh.normals.assign(4, {0, 0, 1});
  ShapeDescription& shape = s.scene.shapes.back();
  shape.kind = MeshShape{std::make_shared<const TriangleMesh>(mesh)};
  shape.object_to_world = {};
  shape.displacement.texture = 0;
  shape.edge_length = edge_length;
  return s.scene;
}

TriangleMesh displaced(const SceneDescription& scene, std::vector<Problem>* warnings = nullptr,
                       size_t most = kMostDisplacedTriangles) {
  std::vector<Problem> none;
  const TextureTable textures(scene.textures);
  const auto out = with_displaced_meshes(scene, textures, 2, warnings ? warnings : &none, most);
  EXPECT_TRUE(none.empty());
  return *std::get<MeshShape>(out.value().shapes.back().kind).mesh;
}

TEST(Displacement, HeightsAndNormalsOfARamp) {
  for (const bool normals : {false, true}) {
    const TriangleMesh mesh = displaced(square(0.8f, 0.3f, normals));
    EXPECT_GT(mesh.triangles.size(), 100u);
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3f& p = mesh.positions[i];
      EXPECT_NEAR(p.z, 0.4f * (p.x + 1), 1e-5f);
      EXPECT_NEAR(mesh.uvs[i].x, (p.x + 1) / 2, 1e-5f);
    }
    ASSERT_EQ(mesh.normals.size(), normals ? mesh.positions.size() : 0u);
    for (const Vec3f& n : mesh.normals) {
      EXPECT_NEAR(n.x, -0.4f / std::sqrt(1.16f), 1e-4f);
      EXPECT_NEAR(n.z, 1 / std::sqrt(1.16f), 1e-4f);
    }
  }
}

TEST(Displacement, EdgesGetAsShortAsAskedWithoutGaps) {
  const SceneDescription scene = square(0, 0.17f, false);
  const TriangleMesh mesh = displaced(scene);
  std::map<std::pair<uint32_t, uint32_t>, int> sides;
  double area = 0;
  for (const auto& t : mesh.triangles) {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = t[k], b = t[(k + 1) % 3];
      const Vec3f &p = mesh.positions[a], &q = mesh.positions[b];
      EXPECT_LE(std::hypot(p.x - q.x, p.y - q.y, p.z - q.z), 0.17f);
      sides[{std::min(a, b), std::max(a, b)}] += 1;
    }
    const Vec3f &a = mesh.positions[t[0]], &b = mesh.positions[t[1]], &c = mesh.positions[t[2]];
    area += 0.5 * ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));  // signed: all face +z
  }
  EXPECT_NEAR(area, 4, 1e-5);
  for (const auto& [edge, count] : sides) {
    const auto on_rim = [&](uint32_t i) {
      return std::max(std::fabs(mesh.positions[i].x), std::fabs(mesh.positions[i].y)) == 1;
    };
    EXPECT_TRUE(count == 2 || (count == 1 && on_rim(edge.first) && on_rim(edge.second)));
  }
}

// A cube whose faces have corners of their own, as flat exporters write it, opens nowhere.
TEST(Displacement, CornersAtOnePlaceStayTogether) {
  TestScene s;
  s.box({-1, -1, -1}, {1, 1, 1}, s.diffuse(0.5f));
  TriangleMesh split;
  for (const ShapeDescription& shape : s.scene.shapes) {
    const TriangleMesh& mesh = *std::get<MeshShape>(shape.kind).mesh;
    for (const auto& t : mesh.triangles) {
      for (const uint32_t i : t) split.positions.push_back(mesh.positions[i]);
      const auto n = static_cast<uint32_t>(split.positions.size());
      split.triangles.push_back({n - 3, n - 2, n - 1});
    }
  }
  s.scene.shapes.resize(1);
  ShapeDescription& shape = s.scene.shapes[0];
  shape.kind = MeshShape{std::make_shared<const TriangleMesh>(split)};
  shape.displacement.value = 0.5f;
  const TriangleMesh mesh = displaced(s.scene);
  std::set<Place> places;
  for (const Vec3f& p : mesh.positions) {
    places.insert(place(p));
    // Along the diagonal, whichever way the box faces.
    const float moved = std::fabs(std::fabs(p.x) - 1);
    EXPECT_NEAR(moved, 0.5f / std::sqrt(3.0f), 1e-4f);
    EXPECT_NEAR(std::fabs(p.y), std::fabs(p.x), 1e-4f);
    EXPECT_NEAR(std::fabs(p.z), std::fabs(p.x), 1e-4f);
  }
  EXPECT_EQ(places.size(), 8u);
}

TEST(Displacement, SplittingEndsAtItsBound) {
  const SceneDescription scene = square(1, 1e-6f, true);
  std::vector<Problem> warnings;
  const TriangleMesh mesh = displaced(scene, &warnings, 1000);
  EXPECT_LE(mesh.triangles.size(), 1000u);
  EXPECT_GT(mesh.triangles.size(), 100u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].message.find("more than 1000 triangles"), std::string::npos);
}

TEST(Displacement, WithoutAnyTheSceneIsLeftAlone) {
  SceneDescription scene = square(1, 0, true);
  scene.shapes.back().displacement = {};
  std::vector<Problem> warnings;
  EXPECT_FALSE(with_displaced_meshes(scene, TextureTable(scene.textures), 1, &warnings));
}

}  // namespace
}  // namespace lightmill::test
