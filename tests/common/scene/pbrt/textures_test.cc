// Procedural textures and mappings: what the reader makes of them.
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class Textures : public SceneTest {
 protected:
  template <class Kind>
  Kind read(const std::string& text) {
    const SceneDescription scene = clean_world(text);
    return std::get<Kind>(scene.textures.at(0).kind);
  }
};

TEST_F(Textures, Bilerp) {
  const auto grey = read<BilerpTexture>("Texture \"t\" \"float\" \"bilerp\" \"float v10\" 0.5");
  EXPECT_EQ(grey.v00, (Rgb{0, 0, 0}));
  EXPECT_EQ(grey.v01, (Rgb{1, 1, 1}));
  EXPECT_EQ(grey.v10, (Rgb{0.5f, 0.5f, 0.5f}));
  const auto color = read<BilerpTexture>(
      "Texture \"t\" \"spectrum\" \"bilerp\" \"rgb v11\" [0.1 0.2 0.3] \"float uscale\" 3");
  EXPECT_EQ(color.v11, (Rgb{0.1f, 0.2f, 0.3f}));
  EXPECT_EQ(color.mapping.su, 3);
}

TEST_F(Textures, NoiseIsInTheSpaceOfTheTransformInForce) {
  const auto t = read<NoiseTexture>(
      "Translate 1 2 3 Scale 2 2 2\nTexture \"t\" \"float\" \"wrinkled\" \"integer octaves\" 3 \"float "
      "roughness\" 0.7");
  EXPECT_EQ(t.kind, NoiseKind::kWrinkled);
  EXPECT_EQ(t.octaves, 3);
  EXPECT_EQ(t.roughness, 0.7f);
  EXPECT_EQ(t.world_to_texture.m[0][0], 0.5);
  EXPECT_EQ(t.world_to_texture.m[2][3], -1.5);
  EXPECT_EQ(read<NoiseTexture>("Texture \"t\" \"spectrum\" \"marble\" \"float variation\" 0.3").variation,
            0.3f);
}

TEST_F(Textures, Mappings) {
  const auto mapping = [&](const std::string& text) {
    return read<CheckerboardTexture>("Texture \"t\" \"spectrum\" \"checkerboard\" " + text).mapping;
  };
  EXPECT_EQ(mapping("").kind, MappingKind::kUv);
  EXPECT_EQ(mapping("\"string mapping\" \"spherical\"").kind, MappingKind::kSpherical);
  EXPECT_EQ(mapping("\"string mapping\" \"cylindrical\"").kind, MappingKind::kCylindrical);
  const UvMapping planar = mapping("\"string mapping\" \"planar\" \"vector3 v1\" [0 0 2]");
  EXPECT_EQ(planar.kind, MappingKind::kPlanar);
  EXPECT_EQ(planar.s_axis.z, 2);
  EXPECT_EQ(planar.t_axis.y, 1);
  EXPECT_TRUE(
      read<CheckerboardTexture>("Texture \"t\" \"float\" \"checkerboard\" \"integer dimension\" 3").solid);
}

TEST_F(Textures, DotsTakeTexturesDefinedBefore) {
  const SceneDescription scene = clean_world(
      "Texture \"a\" \"float\" \"constant\" \"float value\" 0.2\n"
      "Texture \"t\" \"float\" \"dots\" \"texture inside\" \"a\" \"float outside\" 0.1");
  const auto& dots = std::get<DotsTexture>(scene.textures.at(1).kind);
  // Exchanged, as pbrt-v4 renders them.
  EXPECT_EQ(dots.outside.texture, 0);
  EXPECT_EQ(dots.inside.value, (Rgb{0.1f, 0.1f, 0.1f}));
}

TEST_F(Textures, DirectionMixTurnsWithTheSpaceItIsGivenIn) {
  const SceneDescription scene = clean_world(
      "Rotate 90 0 0 1\n"
      "Texture \"t\" \"spectrum\" \"directionmix\" \"vector3 dir\" [0 3 0] \"rgb tex1\" [1 0 0]");
  const auto& mix = std::get<DirectionMixTexture>(scene.textures.at(0).kind);
  EXPECT_NEAR(mix.direction.x, -1, 1e-12);
  EXPECT_NEAR(mix.direction.y, 0, 1e-12);
  EXPECT_EQ(mix.tex1.value, (Rgb{1, 0, 0}));
  EXPECT_EQ(mix.tex2.value, (Rgb{1, 1, 1}));
}

TEST_F(Textures, BadOnesAreNamedWithTheirPlace) {
  const std::pair<const char*, const char*> cases[] = {
      {"Texture \"t\" \"float\" \"marble\"", "is a spectrum texture"},
      {"Texture \"t\" \"spectrum\" \"fbm\"", "is a float texture"},
      {"Texture \"t\" \"float\" \"fbm\" \"integer octaves\" 1000000", "parameter \"octaves\""},
      {"Texture \"t\" \"float\" \"dots\" \"texture inside\" \"later\"", "not defined above"},
      {"Texture \"t\" \"float\" \"directionmix\" \"vector3 dir\" [0 0 0]", "must not be zero"},
      {"Texture \"t\" \"float\" \"bilerp\" \"string mapping\" \"spheric\"", "did you mean \"spherical\""},
  };
  for (const auto& [text, message] : cases)
    EXPECT_TRUE(refused_on_line_2(strictly_world(text), message)) << text;
}

}  // namespace
}  // namespace lightmill
