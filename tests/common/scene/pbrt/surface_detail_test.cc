// What changes a surface without changing its shape or its material: alpha masks, normal maps, bumps.
#include "common/scene/possible_strategies.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

using SurfaceDetail = SceneTest;

TEST_F(SurfaceDetail, AlphaIsANumberOrAFloatTexture) {
  const SceneDescription scene = clean_world(
      "Texture \"leaf\" \"float\" \"checkerboard\"\n"
      "Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 0] \"float alpha\" 0.25\n"
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"texture alpha\" \"leaf\"\n"
      "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0]\n");
  ASSERT_EQ(scene.shapes.size(), 3u);
  EXPECT_EQ(scene.shapes[0].alpha.value, 0.25f);
  EXPECT_EQ(scene.shapes[0].alpha.texture, -1);
  EXPECT_EQ(scene.shapes[1].alpha.texture, 0);
  EXPECT_EQ(scene.shapes[2].alpha.value, 1.0f);
}

TEST_F(SurfaceDetail, AlphaZeroLeavesTheShapeOut) {
  EXPECT_TRUE(clean_world("Shape \"sphere\" \"float alpha\" 0").shapes.empty());
}

TEST_F(SurfaceDetail, BadAlphaIsNamedWithItsPlace) {
  const std::pair<const char*, const char*> cases[] = {
      {"Shape \"sphere\" \"float alpha\" 1.5", "parameter \"alpha\""},
      {"Shape \"sphere\" \"float alpha\" -0.5", "parameter \"alpha\""},
      {"Shape \"sphere\" \"texture alpha\" \"leaf\"", "no float texture named \"leaf\""},
      {"Shape \"sphere\" \"string alpha\" \"leaf.png\"", "parameter \"alpha\""},
  };
  for (const auto& [text, message] : cases)
    EXPECT_TRUE(refused_on_line_2(strictly_world(text), message)) << text;
}

TEST_F(SurfaceDetail, NormalMapsAreLinearImagesAndBumpsFloatTextures) {
  folder_.write("n.png", "not looked into by the reader");
  const SceneDescription scene = clean_world(
      "Texture \"waves\" \"float\" \"checkerboard\"\n"
      "Material \"diffuse\" \"string normalmap\" \"n.png\"\nShape \"sphere\"\n"
      "Material \"dielectric\" \"texture displacement\" \"waves\"\nShape \"sphere\"\n");
  const MaterialDescription& mapped = scene.materials[static_cast<size_t>(scene.shapes[0].material)];
  const MaterialDescription& bumpy = scene.materials[static_cast<size_t>(scene.shapes[1].material)];
  ASSERT_GE(mapped.normal_map, 0);
  EXPECT_EQ(mapped.displacement, -1);
  const auto& image = std::get<ImageTexture>(scene.textures[static_cast<size_t>(mapped.normal_map)].kind);
  EXPECT_EQ(image.encoding, ColorEncoding::kLinear);
  EXPECT_EQ(bumpy.normal_map, -1);
  EXPECT_EQ(bumpy.displacement, 0);
  EXPECT_EQ(scene.files.size(), 2u);  // the scene and the map
}

TEST_F(SurfaceDetail, BlendersMaterialsTakeBumpsOverNormalMapsAndTheirStrength) {
  folder_.write("n.png", "not looked into by the reader");
  const std::string bumps =
      "\"string normalmap\" \"n.png\" \"texture displacement\" \"waves\"\nShape \"sphere\"\n";
  const SceneDescription scene =
      clean_world("Texture \"waves\" \"float\" \"checkerboard\"\nMaterial \"diffuse\" " + bumps +
                  "Material \"diffuse_bsdf\" \"float bump_strength\" 0.25 " + bumps);
  const MaterialDescription& pbrts = scene.materials[static_cast<size_t>(scene.shapes[0].material)];
  const MaterialDescription& blenders = scene.materials[static_cast<size_t>(scene.shapes[1].material)];
  EXPECT_GE(pbrts.normal_map, 0);
  EXPECT_EQ(pbrts.displacement, -1);
  EXPECT_FALSE(pbrts.bump_by_pixel);
  EXPECT_GE(blenders.normal_map, 0);
  EXPECT_EQ(blenders.displacement, 0);
  EXPECT_TRUE(blenders.bump_by_pixel);
  EXPECT_EQ(blenders.bump_strength.value, 0.25f);
  EXPECT_EQ(possible_strategies(scene).set & kLightPaths, 0u);  // it turns to the viewer
}

constexpr const char* kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

TEST_F(SurfaceDetail, DisplacementOfPlyMeshes) {
  folder_.write("m.ply", kPly);
  const std::string shape = "Shape \"plymesh\" \"string filename\" \"m.ply\" ";
  const SceneDescription scene = clean(
      load("Option \"displacementedgescale\" 0.5\nWorldBegin\nLightSource \"point\"\n"
           "Texture \"waves\" \"float\" \"checkerboard\"\n" +
           shape + "\"texture displacement\" \"waves\"\n" + shape +
           "\"float displacement\" 0.5 \"float edgelength\" 0.25\n" + shape + "\"float edgelength\" 2\n"));
  ASSERT_EQ(scene.shapes.size(), 3u);
  EXPECT_EQ(scene.shapes[0].displacement.texture, 0);
  EXPECT_EQ(scene.shapes[0].edge_length, 0.5f);
  EXPECT_EQ(scene.shapes[1].displacement.value, 0.5f);
  EXPECT_EQ(scene.shapes[1].edge_length, 0.125f);
  EXPECT_EQ(scene.shapes[2].displacement.texture, -1);
  EXPECT_EQ(scene.shapes[2].displacement.value, 0);
  EXPECT_TRUE(refused_on_line_2(strictly_world(shape + "\"string later\" \"m.ply\" \"float displacement\" 1"),
                                "bends"));
}

TEST_F(SurfaceDetail, BadBumpsAreNamedWithTheirPlace) {
  const std::pair<const char*, const char*> cases[] = {
      {"Material \"diffuse\" \"string normalmap\" \"none.png\"", "there is no file \"none.png\""},
      {"Material \"diffuse\" \"texture normalmap\" \"t\"", "no spectrum texture named \"t\""},
      {"Material \"diffuse\" \"texture displacement\" \"waves\"", "no float texture named \"waves\""},
  };
  for (const auto& [text, message] : cases)
    EXPECT_TRUE(refused_on_line_2(strictly_world(text), message)) << text;
}

}  // namespace
}  // namespace lightmill
