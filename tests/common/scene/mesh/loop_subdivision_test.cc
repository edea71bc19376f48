#include "common/scene/mesh/loop_subdivision.h"

#include <cmath>
#include <map>
#include <set>

#include "common/base/error.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/transform.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

using Triangles = std::vector<std::array<uint32_t, 3>>;

TriangleMesh control(std::vector<Vec3f> positions, Triangles triangles) {
  TriangleMesh m;
  m.positions = std::move(positions);
  m.triangles = std::move(triangles);
  return m;
}

/// Wound clockwise seen from outside, which is pbrt's outside of a subdivision surface.
TriangleMesh octahedron() {
  return control({{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                 {{0, 4, 2}, {2, 4, 1}, {1, 4, 3}, {3, 4, 0}, {2, 5, 0}, {1, 5, 2}, {3, 5, 1}, {0, 5, 3}});
}

/// A plane of 2 n^2 right triangles over [0, n]^2; the heights are those of `f`.
template <class F>
TriangleMesh plane(uint32_t n, const F& f) {
  TriangleMesh m;
  for (uint32_t j = 0; j <= n; ++j) {
    for (uint32_t i = 0; i <= n; ++i) {
      const auto x = static_cast<float>(i), y = static_cast<float>(j);
      m.positions.push_back({x, y, f(x, y)});
    }
  }
  const auto at = [&](uint32_t i, uint32_t j) { return j * (n + 1) + i; };
  for (uint32_t j = 0; j < n; ++j) {
    for (uint32_t i = 0; i < n; ++i) {
      m.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
      m.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
    }
  }
  return m;
}

size_t edge_count(const TriangleMesh& m) {
  std::set<std::pair<uint32_t, uint32_t>> edges;
  for (const auto& t : m.triangles) {
    for (size_t k = 0; k < 3; ++k) edges.insert(std::minmax(t[k], t[(k + 1) % 3]));
  }
  return edges.size();
}

double dot(const Vec3f& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Vec3d winding(const TriangleMesh& m, const std::array<uint32_t, 3>& t) {
  const Vec3f &a = m.positions[t[0]], &b = m.positions[t[1]], &c = m.positions[t[2]];
  return cross({double{b.x} - a.x, double{b.y} - a.y, double{b.z} - a.z},
               {double{c.x} - a.x, double{c.y} - a.y, double{c.z} - a.z});
}

TEST(LoopSubdivision, AClosedManifoldStaysClosed) {
  for (int levels : {0, 1, 3}) {
    const TriangleMesh m = loop_subdivide(octahedron(), levels);
    EXPECT_EQ(m.triangles.size(), size_t{8} << 2 * levels);
    EXPECT_EQ(m.normals.size(), m.positions.size());
    EXPECT_EQ(m.positions.size() + m.triangles.size(), edge_count(m) + 2) << "Euler's formula";
    for (const auto& t : m.triangles) {
      for (uint32_t v : t) ASSERT_GT(dot(m.normals[v], winding(m, t)), 0);
      ASSERT_GT(dot(m.positions[t[0]], winding(m, t)), 0) << "outwards";
    }
  }
}

TEST(LoopSubdivision, LevelsSampleOneLimitSurface) {
  // Vertices are on the limit surface at every level, and keep their numbers.
  const TriangleMesh coarse = loop_subdivide(octahedron(), 1), fine = loop_subdivide(octahedron(), 5);
  for (size_t v = 0; v < coarse.positions.size(); ++v) {
    const Vec3f &a = coarse.positions[v], &b = fine.positions[v];
    EXPECT_NEAR(a.x, b.x, 1e-6);
    EXPECT_NEAR(a.y, b.y, 1e-6);
    EXPECT_NEAR(a.z, b.z, 1e-6);
    EXPECT_NEAR(coarse.normals[v].x, fine.normals[v].x, 1e-5);
    EXPECT_NEAR(coarse.normals[v].y, fine.normals[v].y, 1e-5);
  }
  // By symmetry a corner's limit is on its axis: 1 - 4 w with w = 1 / (4 + 4), valence 4.
  EXPECT_NEAR(fine.positions[0].x, 0.5, 1e-6);
  EXPECT_NEAR(fine.normals[0].x, 1, 1e-6);
  // Inscribed triangles: the missing area falls fourfold with each level.
  const auto area = [](int levels) { return mesh_area(loop_subdivide(octahedron(), levels), {}); };
  const double a3 = area(3), a4 = area(4), a5 = area(5);
  EXPECT_NEAR((a5 - a4) / (a4 - a3), 0.25, 0.01);
}

TEST(LoopSubdivision, NormalsAreThoseOfTheFineMesh) {
  // A mesh with inner and boundary vertices of many valences: a bent plane with some diagonals flipped.
  TriangleMesh m = plane(3, [](float x, float y) { return 0.3f * x * x - 0.2f * x * y + 0.1f * y; });
  m.triangles[8] = {5, 9, 6};
  m.triangles[9] = {6, 9, 10};
  m.triangles[0] = {0, 4, 1};
  m.triangles[1] = {1, 4, 5};
  const TriangleMesh fine = loop_subdivide(m, 6);
  std::map<uint32_t, Vec3d> sums;
  for (const auto& t : fine.triangles) {
    const Vec3d n = winding(fine, t);
    for (uint32_t v : t) {
      if (v < m.positions.size()) sums[v] = {sums[v].x + n.x, sums[v].y + n.y, sums[v].z + n.z};
    }
  }
  ASSERT_EQ(sums.size(), m.positions.size());
  for (const auto& [v, n] : sums) EXPECT_GT(dot(fine.normals[v], n) / length(n), 0.9995) << v;
}

TEST(LoopSubdivision, BoundariesAreCubicBSplines) {
  // The boundary depends on its own vertices alone: along y = 0 it is the B-spline of heights x^2, which
  // is x^2 + 1/3 at the knots.
  const TriangleMesh m =
      loop_subdivide(plane(4, [](float x, float y) { return x * x + 10 * y * (4 - y); }), 3);
  for (uint32_t i = 1; i < 4; ++i) {
    EXPECT_NEAR(m.positions[i].z, static_cast<float>(i * i) + 1.0f / 3, 1e-5);
    EXPECT_NEAR(m.positions[i].y, 0, 1e-6);
  }
  EXPECT_EQ(m.triangles.size(), 32u * 64);
  EXPECT_EQ(m.positions.size() + m.triangles.size(), edge_count(m) + 1) << "Euler's formula of a disk";
  // A flat mesh stays flat, and the outside is where the control triangles run clockwise.
  const TriangleMesh flat = loop_subdivide(plane(2, [](float, float) { return 1.0f; }), 2);
  for (size_t v = 0; v < flat.positions.size(); ++v) {
    EXPECT_FLOAT_EQ(flat.positions[v].z, 1);
    EXPECT_FLOAT_EQ(flat.normals[v].z, 1);
  }
}

TEST(LoopSubdivision, OneTriangle) {
  const TriangleMesh m = loop_subdivide(control({{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}, {{0, 1, 2}}), 2);
  EXPECT_EQ(m.triangles.size(), 16u);
  for (const Vec3f& n : m.normals) EXPECT_FLOAT_EQ(n.z, 1);
}

TEST(LoopSubdivision, RefusesWhatIsNoManifold) {
  const std::vector<Vec3f> p = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
  const auto why = [&](Triangles t, int levels = 1) -> std::string {
    try {
      loop_subdivide(control(p, std::move(t)), levels);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_NE(why({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}).find("more than two triangles"), std::string::npos);
  EXPECT_NE(why({{0, 1, 2}, {0, 1, 3}}).find("opposite senses"), std::string::npos);
  EXPECT_NE(why({{0, 1, 2}, {0, 3, 4}}).find("meet in vertex 0 alone"), std::string::npos);
  EXPECT_NE(why({{0, 1, 1}}).find("names vertex 1 twice"), std::string::npos);
  EXPECT_NE(why({{0, 1, 2}}, 30).find("use fewer levels"), std::string::npos);
  EXPECT_EQ(why({{0, 1, 2}}), "");
}

class LoopShapes : public SceneTest {};

TEST_F(LoopShapes, AreReadAndMistakesNamed) {
  const std::string tetrahedron =
      "\"point3 P\" [0 0 0 1 0 0 0 1 0 0 0 1] \"integer indices\" [0 1 2 0 2 3 0 3 1 1 3 2]";
  const SceneDescription s = clean_world("Shape \"loopsubdiv\" \"integer levels\" 2 " + tetrahedron);
  EXPECT_EQ(std::get<MeshShape>(s.shapes.at(0).kind).mesh->triangles.size(), 64u);
  EXPECT_EQ(std::get<MeshShape>(clean_world("Shape \"loopsubdiv\" " + tetrahedron).shapes.at(0).kind)
                .mesh->triangles.size(),
            256u)
      << "3 levels unless given";
  const std::pair<std::string, const char*> cases[] = {
      {"Shape \"loopsubdiv\"", "2:1: shape \"loopsubdiv\" needs \"point3 P\""},
      {"Shape \"loopsubdiv\" \"integer levels\" 30 " + tetrahedron, "2:20: parameter \"levels\""},
      {"Shape \"loopsubdiv\" \"integer levels\" -1 " + tetrahedron, "must be at least 0"},
      {"Shape \"loopsubdiv\" \"integer levels\" 11 " + tetrahedron, "use fewer levels"},
      {"Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 nan]", "has the value \"nan\""},
      {"Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]",
       "refers to vertex 3"},
      {"Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0 0 0 1] \"integer indices\" [0 1 2 0 1 3]",
       "2:1: shape \"loopsubdiv\" has an edge from vertex 0 to vertex 1"},
  };
  for (const auto& [text, message] : cases) EXPECT_TRUE(has_error(strictly_world(text), message)) << text;
}

TEST_F(LoopShapes, ShareABoundWithAllTessellatedShapes) {
  const std::string line =
      "Shape \"loopsubdiv\" \"point3 P\" [0 0 0 1 0 0 0 1 0 0 0 1] "
      "\"integer indices\" [0 1 2 0 2 3 0 3 1 1 3 2]\n";  // 256 triangles
  LoadOptions options;
  options.most_generated_triangles = 1000;
  EXPECT_TRUE(load_world(line + line + line, options).ok());
  const LoadResult result = load_world(line + line + line + line + line, options);
  EXPECT_TRUE(has_error(
      result, "5:1: shape \"loopsubdiv\" makes the triangles of all tessellated shapes more than 1000"));
  EXPECT_EQ(result.problems.size(), 1u) << "said once";
}

}  // namespace
}  // namespace lightmill
