// What changes a surface without changing its shape or its material: alpha masks, normal maps, bumps.
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
