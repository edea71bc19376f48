#include <cmath>
#include <numbers>

#include "common/scene/mesh/curve_mesh.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/transform.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

constexpr double kPi = std::numbers::pi;

Vec3d at(const TriangleMesh& m, uint32_t v) { return {m.positions[v].x, m.positions[v].y, m.positions[v].z}; }

/// Normals are unit and on the side of the winding.
void expect_consistent(const TriangleMesh& m) {
  ASSERT_FALSE(m.triangles.empty());
  ASSERT_EQ(m.normals.size(), m.positions.size());
  ASSERT_EQ(m.uvs.size(), m.positions.size());
  EXPECT_NO_THROW(require_valid_mesh(m));
  for (const auto& t : m.triangles) {
    const Vec3d a = at(m, t[0]), b = at(m, t[1]), c = at(m, t[2]);
    const Vec3d n = cross({b.x - a.x, b.y - a.y, b.z - a.z}, {c.x - a.x, c.y - a.y, c.z - a.z});
    for (uint32_t v : t) {
      const Vec3f& s = m.normals[v];
      ASSERT_NEAR(s.x * s.x + s.y * s.y + s.z * s.z, 1, 1e-5);
      ASSERT_GT(s.x * n.x + s.y * n.y + s.z * n.z, 0);
    }
  }
}

/// An arc of a quarter of a circle of radius 1 about the z axis, to 3e-4.
BezierChain quarter(double width) {
  const double k = 0.5522847498;
  BezierChain c;
  c.points = {{1, 0, 0}, {1, k, 0}, {k, 1, 0}, {0, 1, 0}};
  c.width0 = c.width1 = width;
  return c;
}

TEST(CurveMesh, ATubeFollowsItsCurve) {
  for (double width : {1e-4, 0.01, 0.2}) {
    const TriangleMesh m = curve_mesh(quarter(width));
    expect_consistent(m);
    const double tolerance = std::max(width / 8, 1e-3 * 1.66);
    for (const auto& t : m.triangles) {
      const Vec3d a = at(m, t[0]), b = at(m, t[1]);
      const double x = (a.x + b.x) / 2, y = (a.y + b.y) / 2;
      // Middles of chords, too, are within a radius and the tolerance of the arc.
      EXPECT_LT(std::hypot(std::hypot(x, y) - 1, (a.z + b.z) / 2), 0.54 * width + tolerance);
    }
    // The area of a tube of a bent axis is its circumference times the axis' length.
    EXPECT_NEAR(mesh_area(m, {}) / (kPi * width * kPi / 2), 1, 0.01) << width;
    EXPECT_EQ(m.uvs.front().x, 0);
    EXPECT_EQ(m.uvs.back().x, 1);
  }
}

TEST(CurveMesh, SilhouettesHaveTheWidth) {
  for (const auto& [width, bound] : {std::pair{0.001, 0.034}, {0.02, 0.011}, {0.2, 0.003}}) {
    BezierChain c;
    c.points = {{0, 0, 0}, {0, 0, 1.0 / 3}, {0, 0, 2.0 / 3}, {0, 0, 1}};
    c.width0 = c.width1 = width;
    const TriangleMesh m = curve_mesh(c);
    double sum = 0;
    constexpr int kViews = 360;
    for (int i = 0; i < kViews; ++i) {
      const double x = std::cos(kPi * i / kViews), y = std::sin(kPi * i / kViews);
      double lo = 1, hi = -1;
      for (const Vec3f& p : m.positions) {
        lo = std::min(lo, p.x * x + p.y * y);
        hi = std::max(hi, p.x * x + p.y * y);
      }
      EXPECT_NEAR((hi - lo) / width, 1, bound);
      sum += (hi - lo) / width;
    }
    EXPECT_NEAR(sum / kViews, 1, 1e-4) << "the mean width is the circle's";
  }
}

TEST(CurveMesh, TipsAndKinksAndCusps) {
  BezierChain tip = quarter(0.1);
  tip.width1 = 0;
  const TriangleMesh cone = curve_mesh(tip);
  expect_consistent(cone);
  EXPECT_NEAR(mesh_area(cone, {}) / (kPi * 0.05 * kPi / 2), 1, 0.02);
  BezierChain bent;
  bent.degree = 2;
  bent.points = {{0, 0, 0}, {0.5, 0, 0}, {1, 0, 0}, {1, 0.5, 0}, {1, 1, 0}};
  bent.width0 = bent.width1 = 0.01;
  expect_consistent(curve_mesh(bent));
  BezierChain doubled = quarter(0.01);  // the first tangent vanishes
  doubled.points[1] = doubled.points[0];
  expect_consistent(curve_mesh(doubled));
  BezierChain point = quarter(0.1);
  point.points.assign(4, {1, 2, 3});
  EXPECT_TRUE(curve_mesh(point).triangles.empty());
}

TEST(CurveMesh, RibbonsFaceTheirNormals) {
  BezierChain flat = quarter(0.1);
  flat.normals = {{0, 0, 1}, {0, 0, 1}};
  const TriangleMesh m = curve_mesh(flat);
  expect_consistent(m);
  for (const Vec3f& n : m.normals) EXPECT_NEAR(n.z, 1, 1e-5);
  EXPECT_NEAR(mesh_area(m, {}) / (0.1 * kPi / 2), 1, 0.01);
  // A straight ribbon that turns by a quarter.
  BezierChain twisted;
  twisted.points = {{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {0, 0, 3}};
  twisted.width0 = twisted.width1 = 0.2;
  twisted.normals = {{1, 0, 0}, {0, 1, 0}};
  const TriangleMesh t = curve_mesh(twisted);
  expect_consistent(t);
  EXPECT_EQ(t.triangles.size(), 12u) << "15 degrees a chord";
  EXPECT_NEAR(t.normals.back().y, 1, 1e-5);
}

TEST(CurveMesh, BSplinesAreTheirBezierPieces) {
  const std::vector<Vec3d> p = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 1}, {0, 0, 2}};
  const BezierChain cubic = from_bspline(3, p), quadratic = from_bspline(2, p);
  EXPECT_EQ(cubic.pieces(), 2u);
  EXPECT_EQ(quadratic.pieces(), 3u);
  // Knots of a cubic: (1, 4, 1) / 6; one tangent on both sides of them.
  EXPECT_NEAR(cubic.points[3].x, (1 + 4 + 0) / 6.0, 1e-12);
  EXPECT_NEAR(cubic.points[3].y, (0 + 4 + 1) / 6.0, 1e-12);
  EXPECT_NEAR(cubic.points[4].z - cubic.points[3].z, cubic.points[3].z - cubic.points[2].z, 1e-12);
  EXPECT_NEAR(quadratic.points[2].y, 0.5, 1e-12);
}

class CurveShapes : public SceneTest {
 protected:
  static const TriangleMesh& mesh(const SceneDescription& s, size_t i) {
    return *std::get<MeshShape>(s.shapes.at(i).kind).mesh;
  }
  const std::string line_ = "\"string type\" \"cylinder\" \"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 3] ";
};

TEST_F(CurveShapes, AlikeOnesInARowAreOneMesh) {
  const std::string c = "Shape \"curve\" \"float width\" 0.01 " + line_;
  const SceneDescription s = clean_world(c + c + c + "Translate 1 0 0 " + c + c + "Material \"diffuse\" " +
                                         c + "Shape \"sphere\" " + c);
  ASSERT_EQ(s.shapes.size(), 5u);
  EXPECT_EQ(mesh(s, 0).triangles.size(), 3 * mesh(s, 2).triangles.size());
  EXPECT_EQ(mesh(s, 1).triangles.size(), 2 * mesh(s, 2).triangles.size());
  expect_consistent(mesh(s, 0));
  // What is in an object does not join what is before or after it.
  const SceneDescription o =
      clean_world(c + "ObjectBegin \"o\" " + c + c + "ObjectEnd " + c + "ObjectInstance \"o\" " + c);
  ASSERT_EQ(o.shapes.size(), 2u);
  ASSERT_EQ(o.objects.size(), 1u);
  ASSERT_EQ(o.objects[0].shapes.size(), 1u);
  const auto& object = std::get<MeshShape>(o.objects[0].shapes[0].kind).mesh;
  EXPECT_EQ(object->triangles.size(), 2 * mesh(o, 0).triangles.size());
  EXPECT_EQ(mesh(o, 1).triangles.size(), 2 * mesh(o, 0).triangles.size());
}

TEST_F(CurveShapes, FlatOnesAreTubesThatSaySo) {
  const std::string p = "\"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 3] ";
  const SceneDescription s =
      clean_world("Shape \"curve\" " + p + "Shape \"curve\" \"string type\" \"cylinder\" " + p +
                  "Shape \"curve\" \"string type\" \"ribbon\" " + "\"normal N\" [0 1 0 0 1 0] " + p);
  ASSERT_EQ(s.shapes.size(), 3u) << "of different kinds, not joined";
  EXPECT_TRUE(mesh(s, 0).tube && mesh(s, 0).flat);
  EXPECT_TRUE(mesh(s, 1).tube && !mesh(s, 1).flat);
  EXPECT_FALSE(mesh(s, 2).tube || mesh(s, 2).flat);
}

TEST_F(CurveShapes, ACurveWithoutLengthIsLeftOut) {
  const LoadResult r =
      load_world("Shape \"curve\" \"string type\" \"cylinder\" \"point3 P\" [1 1 1 1 1 1 1 1 1 1 1 1]");
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "shape \"curve\" has no length"));
  EXPECT_TRUE(r.scene.shapes.empty());
}

TEST_F(CurveShapes, Mistakes) {
  const std::pair<std::string, const char*> cases[] = {
      {"Shape \"curve\"", "2:1: shape \"curve\" needs \"point3 P\""},
      {"Shape \"curve\" \"point3 P\" [0 0 0 0 0 1 0 0 nan 0 0 3]", "has the value \"nan\""},
      {"Shape \"curve\" \"point3 P\" [0 0 0 0 0 1 0 0 2]", "2:1: shape \"curve\" has 3 points"},
      {"Shape \"curve\" \"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 3 0 0 4]", "need 4, 7, 10"},
      {"Shape \"curve\" \"float width\" 0 " + line_, "has a \"width\" that is not above 0"},
      {"Shape \"curve\" \"float width0\" -1 " + line_, "must be at least 0"},
      {"Shape \"curve\" \"integer degree\" 4 " + line_, "must be at most 3"},
      {"Shape \"curve\" \"string basis\" \"bspine\" " + line_, "did you mean \"bspline\"?"},
      {"Shape \"curve\" \"string type\" \"ribon\" \"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 3]",
       "did you mean \"ribbon\"?"},
      {"Shape \"curve\" \"string type\" \"ribbon\" \"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 3]",
       "needs \"normal N\""},
      {"Shape \"curve\" \"string type\" \"ribbon\" \"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 3] \"normal N\" [0 0 "
       "1]",
       "has 1 normals; the curve needs 2"},
      {"Shape \"curve\" \"string type\" \"ribbon\" \"point3 P\" [0 0 0 0 0 1 0 0 2 0 0 3] \"normal N\" "
       "[0 0 1 0 0 0]",
       "normal without direction"},
  };
  for (const auto& [text, message] : cases) EXPECT_TRUE(has_error(strictly_world(text), message)) << text;
}

}  // namespace
}  // namespace lightmill
