#include "common/scene/tessellate.h"

#include <cmath>
#include <numbers>

#include "common/scene/mesh_check.h"
#include "common/scene/transform.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

constexpr double kPi = std::numbers::pi;

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

TEST(Tessellate, AreasAndOrientations) {
  const TriangleMesh sphere = sphere_mesh(2, -2, 2, 2 * kPi);
  EXPECT_NEAR(mesh_area(sphere, {}) / (16 * kPi), 1, 5e-4);
  expect_orientation(sphere, [](const Vec3d& p) { return p; });
  // Archimedes: a zone's area is 2 pi r h.
  EXPECT_NEAR(mesh_area(sphere_mesh(2, 0.5, 1, kPi), {}) / (kPi * 2 * 0.5), 1, 5e-4);

  const TriangleMesh cylinder = cylinder_mesh(0.5, -1, 2, 2 * kPi);
  EXPECT_NEAR(mesh_area(cylinder, {}) / (3 * kPi), 1, 5e-4);
  expect_orientation(cylinder, [](const Vec3d& p) { return Vec3d{p.x, p.y, 0}; });

  const TriangleMesh disk = disk_mesh(1, 2, 0, 2 * kPi);
  EXPECT_NEAR(mesh_area(disk, {}) / (4 * kPi), 1, 5e-4);
  expect_orientation(disk, [](const Vec3d&) { return Vec3d{0, 0, 1}; });
  EXPECT_NEAR(mesh_area(disk_mesh(0, 2, 1, kPi / 2), {}) / (0.75 * kPi), 1, 5e-4);
}

TEST(Tessellate, PatchesFollowTheirCorners) {
  const TriangleMesh flat = patch_mesh({{{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {2, 1, 0}}});
  EXPECT_EQ(flat.triangles.size(), 2u);
  EXPECT_NEAR(mesh_area(flat, {}), 2, 1e-6);
  expect_orientation(flat, [](const Vec3d&) { return Vec3d{0, 0, 1}; });
  EXPECT_GT(patch_mesh({{{0, 0, 0}, {2, 0, 0}, {0, 1, 0}, {2, 1, 1}}}).triangles.size(), 100u);
}

class QuadricShapes : public SceneTest {
 protected:
  static double area(const SceneDescription& s, size_t i) {
    return mesh_area(*std::get<MeshShape>(s.shapes.at(i).kind).mesh, s.shapes[i].object_to_world);
  }
};

TEST_F(QuadricShapes, BecomeMeshesAndAreNamed) {
  const LoadResult r = load_world(R"(AreaLightSource "diffuse" "float power" 10
    Shape "disk" "float radius" 2 "float innerradius" 1
    Shape "cylinder" "float zmax" 2
    Shape "bilinearmesh" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 0]
    Scale 1 2 3 Shape "sphere" "float radius" 0.5)");
  ASSERT_TRUE(r.ok()) << listed(r);
  EXPECT_EQ(r.problems.size(), 3u) << listed(r);
  EXPECT_NEAR(area(r.scene, 0), 3 * kPi, 0.01);
  EXPECT_NEAR(area(r.scene, 1), 6 * kPi, 0.01);
  EXPECT_NEAR(area(r.scene, 2), 1, 1e-6);
  // Knud Thomsen's formula for the ellipsoid's area, good to about 1 %.
  const double a = 0.5, b = 1, c = 1.5, p = 1.6075;
  const double mean = (std::pow(a * b, p) + std::pow(a * c, p) + std::pow(b * c, p)) / 3;
  EXPECT_NEAR(area(r.scene, 3), 4 * kPi * std::pow(mean, 1 / p), 0.15);
  EXPECT_NEAR(r.scene.area_lights.at(0).radiance.r, 10 / (kPi * 3 * kPi), 1e-4)
      << "one emitter, not one a triangle";
}

TEST_F(QuadricShapes, Mistakes) {
  const std::pair<const char*, const char*> cases[] = {
      {"Shape \"disk\" \"float radius\" 0", "must be above 0"},
      {"Shape \"disk\" \"float innerradius\" 1", "must be below \"radius\""},
      {"Shape \"cylinder\" \"float zmin\" 1", "must differ from \"zmin\""},
      {"Shape \"sphere\" \"float zmin\" 2 \"float zmax\" 3", "leave nothing"},
      {"Shape \"sphere\" \"float phimax\" 0", "must be above 0"},
      {"Shape \"bilinearmesh\"", "needs \"point3 P\""},
      {"Shape \"bilinearmesh\" \"point3 P\" [0 0 0]", "unless it is one patch"},
      {"Shape \"bilinearmesh\" \"point3 P\" [0 0 0] \"integer indices\" [0 0 0 1]", "does not exist"},
      {"Shape \"bilinearmesh\" \"point3 P\" [0 0 0] \"integer indices\" [0 0 0]", "4 per patch"},
  };
  for (const auto& [text, message] : cases) EXPECT_TRUE(has_error(load_world(text), message)) << text;
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
