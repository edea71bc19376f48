#include "common/scene/transform.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class Shapes : public SceneTest {
 protected:
  static const TriangleMesh& mesh(const SceneDescription& scene, size_t i) {
    return *std::get<MeshShape>(scene.shapes.at(i).kind).mesh;
  }
};

TEST_F(Shapes, TriangleMesh) {
  const SceneDescription s = clean_world(R"(Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 1 1 0 0 1 0]
    "integer indices" [0 1 2 0 2 3] "normal N" [0 0 1 0 0 1 0 0 1 0 0 1] "point2 uv" [0 0 1 0 1 1 0 1])");
  const TriangleMesh& m = mesh(s, 0);
  ASSERT_EQ(m.positions.size(), 4u);
  EXPECT_EQ(m.positions[2].y, 1);
  EXPECT_EQ(m.normals.at(3).z, 1);
  EXPECT_EQ(m.uvs.at(1).x, 1);
  EXPECT_EQ(m.triangles, (std::vector<std::array<uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(s.shapes[0].location.line, 2);
}

TEST_F(Shapes, IndicesOfASingleTriangleMayBeLeftOut) {
  EXPECT_EQ(mesh(clean_world("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]"), 0).triangles.size(),
            1u);
}

// As in pbrt, where a quadric's normal turns under a mirror, and light is placed on quadrics as if it did
// not.
TEST_F(Shapes, AMirrorTurnsQuadricsThatDoNotShine) {
  for (const std::string shape : {"sphere", "disk", "cylinder"}) {
    const auto flips = [&](const std::string& before) {
      return surface_flips_normal(clean_world(before + " Shape \"" + shape + "\"").shapes.at(0));
    };
    EXPECT_FALSE(flips("")) << shape;
    EXPECT_TRUE(flips("ReverseOrientation")) << shape;
    const bool winding = shape != "sphere";  // a mirror swaps that, too
    EXPECT_EQ(flips("Scale 1 1 -1"), !winding) << shape;
    EXPECT_EQ(flips("Scale 1 1 -1 ReverseOrientation"), winding) << shape;
    EXPECT_EQ(flips("Scale 1 1 -1 AreaLightSource \"diffuse\""), winding) << shape;
  }
}

TEST_F(Shapes, SphereAndItsFullRange) {
  const SceneDescription s = clean_world(
      "Shape \"sphere\" \"float radius\" 2 \"float zmin\" -2 \"float zmax\" 5 \"float phimax\" 360");
  EXPECT_EQ(std::get<SphereShape>(s.shapes.at(0).kind).radius, 2);
}

TEST_F(Shapes, TrianglesWithoutAreaAreDroppedWithOneWarning) {
  const LoadResult r = load_world(
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 2 0 0] \"integer indices\" [0 1 2 0 0 1 0 1 "
      "3]");
  EXPECT_TRUE(r.ok());
  ASSERT_EQ(r.problems.size(), 1u);
  EXPECT_NE(r.problems[0].message.find("2 triangles without area"), std::string::npos);
  EXPECT_EQ(mesh(r.scene, 0).triangles.size(), 1u);
}

TEST_F(Shapes, TinyTrianglesAreKept) {
  const SceneDescription s = clean_world("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1e-30 0 0 0 1e-30 0]");
  EXPECT_EQ(s.shapes.size(), 1u);
}

TEST_F(Shapes, AShapeWithoutAnyAreaIsLeftOut) {
  const LoadResult r =
      load_world("AreaLightSource \"diffuse\" Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 2 0 0]");
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "no triangle with area"));
  EXPECT_TRUE(r.scene.shapes.empty());
}

TEST_F(Shapes, NormalsWithoutDirectionAreMended) {
  const LoadResult r =
      load_world("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [0 0 0 0 0 -1 0 0 0]");
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "2 normals without direction"));
  EXPECT_EQ(mesh(r.scene, 0).normals[0].z, 1);
  EXPECT_EQ(mesh(r.scene, 0).normals[1].z, -1);
}

TEST_F(Shapes, Mistakes) {
  const std::pair<const char*, const char*> cases[] = {
      {"Shape \"sphear\"", "unknown shape \"sphear\"; did you mean \"sphere\"?"},
      {"Shape \"sphere\" \"float radius\" 0", "must be above 0"},
      {"Shape \"sphere\" \"float radius\" -1", "must be above 0"},
      {"Shape \"sphere\" \"float raduis\" 1", "did you mean \"radius\"?"},
      {"Shape \"trianglemesh\"", "needs \"point3 P\""},
      {"Shape \"trianglemesh\" \"float P\" [0 0 0]", "it must be \"point3\""},
      {"Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1]", "multiple of 3"},
      {"Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 nan]", "has the value \"nan\""},
      {"Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 1]", "needs \"integer indices\""},
      {"Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 3]",
       "refers to vertex 3, but there are 3"},
      {"Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 -2]",
       "negative index"},
      {"Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1]", "3 per triangle"},
      {"Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [0 0 1]",
       "1 normals for 3 vertices"},
      {"Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"point2 uv\" [0 0]",
       "1 uv pairs for 3 vertices"},
      {"Shape \"plymesh\"", "needs a \"string filename\""},
      {"Shape \"plymesh\" \"string filename\" \"none.ply\"", "2:17: there is no file \"none.ply\""},
      {"Translate 1e38 1e38 1e38 Shape \"sphere\"", "outside the range"},
      {"AreaLightSource \"difuse\"", "did you mean \"diffuse\"?"},
      {"AreaLightSource \"diffuse\" \"rgb L\" [1e38 1 1] \"float scale\" 1e10", "brighter than float"},
  };
  for (const auto& [text, message] : cases) EXPECT_TRUE(has_error(strictly_world(text), message)) << text;
}

}  // namespace
}  // namespace lightmill
