// Textures against the ranges of what they feed.
#include "worker/render/scene/textures/texture_check.h"

#include <gmock/gmock.h>

namespace lightmill::test {
namespace {

using ::testing::HasSubstr;

/// Warnings of a diffuse material whose reflectance is the last of `textures`.
std::vector<Problem> warnings(std::vector<TextureKind> textures) {
  SceneDescription scene;
  for (const TextureKind& kind : textures) {
    const int line = static_cast<int>(scene.textures.size()) + 1;
    scene.textures.push_back({"t" + std::to_string(line), true, kind, {"a.pbrt", line, 1}});
  }
  DiffuseMaterial paint;
  paint.reflectance.texture = static_cast<int>(textures.size()) - 1;
  scene.materials.push_back({"paint", paint, {"a.pbrt", 9, 1}});
  return check_textures(scene, TextureTable(scene.textures));
}

ConstantTexture constant(float x) { return {{x, x, x}}; }
SpectrumInput texture(int index) { return {{}, index}; }

TEST(TextureCheck, ValuesWithinTheUnitAreFine) {
  EXPECT_TRUE(warnings({constant(0)}).empty());
  EXPECT_TRUE(warnings({constant(1)}).empty());
  EXPECT_TRUE(warnings({constant(4), ScaleTexture{texture(0), {0.25f, -1}}}).empty());
  EXPECT_TRUE(warnings({constant(0.5f), MixTexture{texture(0), {{1, 1, 1}, -1}, {0.5f, -1}}}).empty());
}

TEST(TextureCheck, WhatLeavesItIsNamed) {
  const std::vector<Problem> above = warnings({constant(3)});
  ASSERT_EQ(above.size(), 1u);
  EXPECT_EQ(above[0].severity, Severity::kWarning);
  EXPECT_EQ(above[0].where.line, 1);
  EXPECT_THAT(above[0].message, HasSubstr("\"t1\" has values from 3 to 3"));
  EXPECT_THAT(above[0].message, HasSubstr("the reflectance of the material \"paint\""));
  EXPECT_EQ(warnings({constant(-0.1f)}).size(), 1u);
}

TEST(TextureCheck, RangesGoThroughTheGraph) {
  const std::vector<Problem> scaled = warnings({constant(0.5f), ScaleTexture{texture(0), {10, -1}}});
  ASSERT_EQ(scaled.size(), 1u);
  EXPECT_EQ(scaled[0].where.line, 2);
  EXPECT_THAT(scaled[0].message, HasSubstr("from 5 to 5"));
  // A mix outside of its inputs, and a board of which one square is too bright.
  EXPECT_EQ(warnings({constant(1), MixTexture{{{0, 0, 0}, -1}, texture(0), {2, -1}}}).size(), 1u);
  CheckerboardTexture board;
  board.tex1 = {{0.5f, 0.5f, 0.5f}, -1};
  board.tex2 = texture(0);
  EXPECT_EQ(warnings({constant(2), board}).size(), 1u);
}

TEST(TextureCheck, RoughnessIsWithinTheUnitToo) {
  SceneDescription scene;
  scene.textures.push_back({"r", false, constant(-3), {"a.pbrt", 1, 1}});
  ConductorMaterial metal;
  metal.roughness.u.texture = metal.roughness.v.texture = 0;
  scene.materials.push_back({"", metal, {"a.pbrt", 2, 1}});
  const std::vector<Problem> found = check_textures(scene, TextureTable(scene.textures));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_THAT(found[0].message, HasSubstr("the roughness of the material in line 2"));
}

}  // namespace
}  // namespace lightmill::test
