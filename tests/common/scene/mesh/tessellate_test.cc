#include "common/scene/mesh/tessellate.h"

#include <cmath>
#include <numbers>

#include "common/scene/mesh/mesh_check.h"
#include "common/scene/transform.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

constexpr double kHalfTurn = std::numbers::pi;

/// Every triangle's winding agrees with `outward` at its first vertex.
template <class F>
void expect_orientation(const TriangleMesh& m, const F& outward) {
  const auto at = [&](uint32_t v) { return Vec3d{m.positions[v].x, m.positions[v].y, m.positions[v].z}; };
  for (const auto& t : m.triangles) {
    const Vec3d a = at(t[0]), b = at(t[1]), c = at(t[2]);
    const Vec3d n = cross({b.x - a.x, b.y - a.y, b.z - a.z}, {c.x - a.x, c.y - a.y, c.z - a.z});
    const Vec3d o = outward({(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3, (a.z + b.z + c.z) / 3});
    ASSERT_GT(n.x * o.x + n.y * o.y + n.z * o.z, 0);
  }
  EXPECT_NO_THROW(require_valid_mesh(m));
}

/// Largest distance of points on the mesh from the radius `radius(p)` = 1, taken at the middles of triangles
/// and edges.
template <class F>
double largest_miss(const TriangleMesh& m, const F& radius) {
  double miss = 0;
  const auto at = [&](uint32_t v) { return Vec3d{m.positions[v].x, m.positions[v].y, m.positions[v].z}; };
  for (const auto& t : m.triangles) {
    const Vec3d a = at(t[0]), b = at(t[1]), c = at(t[2]);
    const Vec3d points[] = {
        a,
        {(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2},
        {(a.x + c.x) / 2, (a.y + c.y) / 2, (a.z + c.z) / 2},
        {(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3, (a.z + b.z + c.z) / 3},
    };
    for (const Vec3d& p : points) miss = std::max(miss, std::abs(radius(p) - 1));
  }
  return miss;
}

TEST(Tessellate, AreasAreExact) {
  const auto ratio = [](const TriangleMesh& m, double area) { return mesh_area(m, {}) / area; };
  EXPECT_NEAR(ratio(sphere_mesh(2, -2, 2, 2 * kHalfTurn), 16 * kHalfTurn), 1, 1e-6);
  // Archimedes: a zone's area is 2 pi r h.
  EXPECT_NEAR(ratio(sphere_mesh(2, 0.5, 1, kHalfTurn), kHalfTurn * 2 * 0.5), 1, 1e-6);
  EXPECT_NEAR(ratio(sphere_mesh(1, -1, 1, 2 * kHalfTurn, 32), 4 * kHalfTurn), 1, 1e-6);
  EXPECT_NEAR(ratio(cylinder_mesh(0.5, -1, 2, 2 * kHalfTurn), 3 * kHalfTurn), 1, 1e-6);
  EXPECT_NEAR(ratio(cylinder_mesh(0.5, -1, 2, 0.01), 0.015), 1, 1e-5);
  EXPECT_NEAR(ratio(disk_mesh(1, 2, 0, 2 * kHalfTurn), 4 * kHalfTurn), 1, 1e-6);
  EXPECT_NEAR(ratio(disk_mesh(0, 2, 1, kHalfTurn / 2), 0.75 * kHalfTurn), 1, 1e-6);
}

TEST(Tessellate, ShapesAreMissedByLessThanStated) {
  const auto around = [](const Vec3d& p) { return std::hypot(p.x, p.y); };
  EXPECT_LT(largest_miss(cylinder_mesh(1, 0, 1, 2 * kHalfTurn), around), 5e-6);
  for (int segments : {32, 256}) {
    EXPECT_LT(largest_miss(sphere_mesh(1, -1, 1, 2 * kHalfTurn, segments),
                           [](const Vec3d& p) { return length(p); }),
              7.0 / (segments * segments));
  }
  const TriangleMesh disk = disk_mesh(0, 1, 0, 2 * kHalfTurn);
  double rim = 1;
  for (const auto& t : disk.triangles) {  // (outer, next outer, centre)
    const Vec3f &a = disk.positions[t[0]], &b = disk.positions[t[1]];
    EXPECT_NEAR(std::hypot(a.x, a.y), 1, 5e-6);
    rim = std::min(rim, std::hypot(double{a.x} + b.x, double{a.y} + b.y) / 2);
  }
  EXPECT_NEAR(rim, 1, 5e-6);
}

TEST(Tessellate, Orientations) {
  expect_orientation(sphere_mesh(2, -2, 2, 2 * kHalfTurn), [](const Vec3d& p) { return p; });
  expect_orientation(cylinder_mesh(0.5, -1, 2, 2 * kHalfTurn), [](const Vec3d& p) {
    return Vec3d{p.x, p.y, 0};
  });
  expect_orientation(disk_mesh(1, 2, 0.5, 2 * kHalfTurn), [](const Vec3d&) { return Vec3d{0, 0, 1}; });
}

BilinearPatch patch(std::array<Vec3f, 4> corners) {
  BilinearPatch p;
  p.corners = corners;
  return p;
}

TEST(Tessellate, PatchesAreAsFineAsTheyAreCurved) {
  const TriangleMesh flat = patch_mesh(patch({{{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {2, 1, 0}}}), false);
  EXPECT_EQ(flat.triangles.size(), 2u);
  EXPECT_NEAR(mesh_area(flat, {}), 2, 1e-6);
  expect_orientation(flat, [](const Vec3d&) { return Vec3d{0, 0, 1}; });
  const auto segments = [](float lift) {
    return patch_segments(patch({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, lift}}}));
  };
  EXPECT_EQ(segments(1e-5f), 1);
  EXPECT_LT(segments(0.01f), segments(0.1f));
  EXPECT_LT(segments(0.1f), segments(1));
  EXPECT_LE(segments(100), 64);
  // z = u v over the unit square: the integral of sqrt(1 + u^2 + v^2), and its normals.
  const TriangleMesh saddle = patch_mesh(patch({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}}}), true);
  EXPECT_NEAR(mesh_area(saddle, {}) / 1.2807892, 1, 1e-4);
  for (size_t i = 0; i < saddle.positions.size(); ++i) {
    const Vec3f &p = saddle.positions[i], &n = saddle.normals[i];
    EXPECT_NEAR(p.z, p.x * p.y, 1e-6);
    EXPECT_NEAR(n.x / n.z, -p.y, 1e-5);
    EXPECT_NEAR(n.y / n.z, -p.x, 1e-5);
    EXPECT_EQ(saddle.uvs[i].x, p.x);
  }
}

TEST(Tessellate, PatchesTakeNormalsAndUvs) {
  BilinearPatch p = patch({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}});
  p.uvs = {{{0, 0}, {2, 0}, {0, 3}, {2, 3}}};
  const std::array<Vec3f, 4> normals{{{0, 0, 1}, {0, 3, 4}, {0, 0, 1}, {0, 0, 1}}};
  p.normals = &normals;
  const TriangleMesh m = patch_mesh(p, true);
  ASSERT_EQ(m.triangles.size(), 2u);
  EXPECT_FLOAT_EQ(m.normals[1].y, 0.6f);
  EXPECT_EQ(m.uvs[3].x, 2);
  EXPECT_EQ(m.uvs[3].y, 3);
}

class QuadricShapes : public SceneTest {
 protected:
  static double area(const SceneDescription& s, size_t i) {
    return mesh_area(*std::get<MeshShape>(s.shapes.at(i).kind).mesh, s.shapes[i].object_to_world);
  }
};

TEST_F(QuadricShapes, BecomeMeshesOfTheirArea) {
  const SceneDescription s = clean_world(R"(AreaLightSource "diffuse" "float power" 10
    Shape "disk" "float radius" 2 "float innerradius" 1
    Shape "cylinder" "float zmax" 2
    Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 0]
    Scale 1 2 3 Shape "sphere" "float radius" 0.5)");
  EXPECT_NEAR(area(s, 0), 3 * kHalfTurn, 1e-5);
  EXPECT_NEAR(area(s, 1), 6 * kHalfTurn, 1e-5);
  EXPECT_NEAR(area(s, 2), 1, 1e-6);
  // Knud Thomsen's formula for the ellipsoid's area, good to about 1 %.
  const double a = 0.5, b = 1, c = 1.5, p = 1.6075;
  const double mean = (std::pow(a * b, p) + std::pow(a * c, p) + std::pow(b * c, p)) / 3;
  EXPECT_NEAR(area(s, 3), 4 * kHalfTurn * std::pow(mean, 1 / p), 0.15);
  EXPECT_NEAR(s.area_lights.at(0).radiance.r, 10 / (kHalfTurn * 3 * kHalfTurn), 1e-6)
      << "one emitter, not one a triangle";
}

TEST_F(QuadricShapes, VeryManyStretchedSpheresAreCoarser) {
  const auto spheres = [](int hundreds) {
    std::string text = "Scale 1 1 2 ";
    for (int i = 0; i < 100 * hundreds; ++i) text += "Shape \"sphere\" ";
    return text;
  };
  const auto mesh = [](const SceneDescription& s, size_t i) {
    return std::get<MeshShape>(s.shapes.at(i).kind).mesh;
  };
  const SceneDescription few = clean_world(spheres(1)), many = clean_world(spheres(10));
  EXPECT_GT(mesh(few, 0)->triangles.size(), 60000u);
  EXPECT_LT(mesh(many, 0)->triangles.size(), 4097u);
  EXPECT_EQ(mesh(many, 0), mesh(many, 999)) << "shared";
  const LoadResult r = load_world(spheres(30));
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_EQ(r.problems.size(), 1u) << listed(r);
  EXPECT_TRUE(
      mentions(r, "3000 spheres under a non-uniform scale; each is drawn as 1024 triangles, within 1 %"));
}

TEST_F(QuadricShapes, BilinearMeshesTakeNormalsAndUvs) {
  const SceneDescription s = clean_world(R"(Shape "bilinearmesh" "integer indices" [0 1 2 3 2 3 4 5]
    "point3 P" [0 0 0 1 0 0 0 1 0 1 1 0 0 2 0 1 2 1]
    "normal N" [0 0 1 0 0 1 0 0 1 0 0 1 0 1 0 0 1 0] "point2 uv" [0 0 1 0 0 0.5 1 0.5 0 1 1 1])");
  const TriangleMesh& m = *std::get<MeshShape>(s.shapes.at(0).kind).mesh;
  EXPECT_EQ(m.normals.size(), m.positions.size());
  EXPECT_EQ(m.uvs.at(3).y, 0.5f);
  EXPECT_FLOAT_EQ(m.normals.back().y, 1);
  EXPECT_FLOAT_EQ(m.uvs.back().y, 1);
  EXPECT_GT(m.triangles.size(), 100u) << "the second patch is curved";
}

TEST_F(QuadricShapes, Mistakes) {
  const std::pair<const char*, const char*> cases[] = {
      {"Shape \"disk\" \"float radius\" 0", "must be above 0"},
      {"Shape \"disk\" \"float innerradius\" 1", "must be below \"radius\""},
      {"Shape \"cylinder\" \"float zmin\" 1", "must differ from \"zmin\""},
      {"Shape \"sphere\" \"float zmin\" 2 \"float zmax\" 3", "leave nothing"},
      {"Shape \"sphere\" \"float phimax\" 0", "must be above 0"},
      {"Shape \"disk\" \"float phimax\" 361", "2:14: parameter \"phimax\""},
      {"Shape \"cylinder\" \"float radius\" nan", "has the value \"nan\""},
      {"Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] \"normal N\" [0 0 1]",
       "1 normals for 4 vertices"},
      {"Shape \"bilinearmesh\"", "needs \"point3 P\""},
      {"Shape \"bilinearmesh\" \"point3 P\" [0 0 0]", "unless it is one patch"},
      {"Shape \"bilinearmesh\" \"point3 P\" [0 0 0] \"integer indices\" [0 0 0 1]", "does not exist"},
      {"Shape \"bilinearmesh\" \"point3 P\" [0 0 0] \"integer indices\" [0 0 0]", "4 per patch"},
  };
  for (const auto& [text, message] : cases) EXPECT_TRUE(has_error(strictly_world(text), message)) << text;
}

TEST_F(QuadricShapes, InterfaceShapesAreLeftOut) {
  const LoadResult r = load_world(
      "Material \"interface\" Shape \"sphere\" Material \"diffuse\" Shape \"sphere\"\n"
      "NamedMaterial \"air\" Shape \"sphere\" MakeNamedMaterial \"air\" \"string type\" \"interface\"");
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_EQ(r.scene.shapes.size(), 1u);
}

}  // namespace
}  // namespace lightmill
