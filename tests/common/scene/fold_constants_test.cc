#include "common/scene/fold_constants.h"

#include <gtest/gtest.h>

#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class FoldConstants : public SceneTest {
 protected:
  /// What a diffuse sphere's reflectance is that `textures` define as "t".
  SpectrumInput reflectance(const std::string& textures) {
    const SceneDescription s = clean_world(textures +
                                           "\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\n"
                                           "Shape \"sphere\"");
    const auto material = static_cast<size_t>(s.shapes.at(0).material);
    return std::get<DiffuseMaterial>(s.materials.at(material).kind).reflectance;
  }
  /// Of the one shape's material, or "" if it has none.
  std::string shown(const std::string& body) {
    const SceneDescription s = clean_world(body + "\nShape \"sphere\"");
    return s.materials.at(static_cast<size_t>(s.shapes.at(0).material)).name;
  }
  static constexpr const char* kTwo =
      "MakeNamedMaterial \"a\" \"string type\" \"diffuse\"\n"
      "MakeNamedMaterial \"b\" \"string type\" \"dielectric\"\n";
};

TEST_F(FoldConstants, TexturesThatAreTheSameEverywhereBecomeValues) {
  const std::string c = "Texture \"c\" \"spectrum\" \"constant\" \"rgb value\" [0.2 0.4 0.6]\n";
  const std::pair<std::string, Rgb> cases[] = {
      {"Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [0.2 0.4 0.6]", {0.2f, 0.4f, 0.6f}},
      {c + "Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"c\" \"float scale\" 0.5",
       {0.1f, 0.2f, 0.3f}},
      {c + "Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"c\" \"texture tex2\" \"c\"",
       {0.2f, 0.4f, 0.6f}},
      {c + "Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"c\" \"rgb tex2\" [1 1 1] \"float amount\" "
           "1",
       {1, 1, 1}},
      {c + "Texture \"t\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"c\" \"rgb tex2\" [0.2 0.4 0.6]",
       {0.2f, 0.4f, 0.6f}},
      {"Texture \"t\" \"spectrum\" \"bilerp\" \"rgb v00\" [1 0 1] \"rgb v01\" [1 0 1] \"rgb v10\" [1 0 1] "
       "\"rgb "
       "v11\" [1 0 1]",
       {1, 0, 1}}};
  for (const auto& [textures, value] : cases) {
    const SpectrumInput in = reflectance(textures);
    EXPECT_EQ(in.texture, -1) << textures;
    EXPECT_EQ(in.value, value) << textures;
  }
}

TEST_F(FoldConstants, WhatVariesOrIsOutOfRangeStays) {
  for (const char* textures :
       {"Texture \"t\" \"spectrum\" \"checkerboard\"", "Texture \"t\" \"spectrum\" \"bilerp\"",
        "Texture \"t\" \"spectrum\" \"marble\"",
        "Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [0.5 0.5 1.5]"})
    EXPECT_EQ(reflectance(textures).texture, 0) << textures;
}

// A mix of textures that shows one of them is that one; the other's image is not in the bundle.
TEST_F(FoldConstants, MixesOfTexturesMayShowOneOfThem) {
  folder_.write("seen.png", "an image");
  folder_.write("hidden.png", "an image");
  const SceneDescription s = clean_world(
      "Texture \"s\" \"spectrum\" \"imagemap\" \"string filename\" \"seen.png\"\n"
      "Texture \"h\" \"spectrum\" \"imagemap\" \"string filename\" \"hidden.png\"\n"
      "Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"s\" \"texture tex2\" \"h\" \"float amount\" 0\n"
      "Material \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"");
  EXPECT_EQ(std::get<DiffuseMaterial>(s.materials.back().kind).reflectance.texture, 0);
  ASSERT_EQ(s.files.size(), 2u);
  EXPECT_EQ(s.files[1].name, "seen.png");
}

TEST_F(FoldConstants, MixesThatShowOneMaterialAreThatMaterial) {
  const auto mix = [](const char* name, const char* parts, const char* amount) {
    return std::string("MakeNamedMaterial \"") + name + "\" \"string type\" \"mix\" \"string materials\" [" +
           parts + "] " + amount + "\n";
  };
  const std::string use = "NamedMaterial \"m\"";
  EXPECT_EQ(shown(kTwo + mix("m", "\"a\" \"b\"", "\"float amount\" 0") + use), "a");
  EXPECT_EQ(shown(kTwo + mix("m", "\"a\" \"b\"", "\"float amount\" 1") + use), "b");
  EXPECT_EQ(shown(kTwo + mix("m", "\"b\" \"b\"", "") + use), "b");
  EXPECT_EQ(shown(kTwo + mix("m", "\"a\" \"b\"", "") + use), "m");
  // Through mixes of mixes, and by a constant texture.
  const std::string inner = kTwo + mix("i", "\"a\" \"b\"", "\"float amount\" 1");
  EXPECT_EQ(shown(inner + mix("m", "\"i\" \"a\"", "\"float amount\" 0") + use), "b");
  EXPECT_EQ(shown(inner + mix("j", "\"i\" \"i\"", "") + mix("m", "\"j\" \"j\"", "") + use), "b");
  EXPECT_EQ(shown("Texture \"z\" \"float\" \"constant\" \"float value\" 0\n" + std::string(kTwo) +
                  mix("m", "\"a\" \"b\"", "\"texture amount\" \"z\"") + use),
            "a");
  // The inner one is resolved where the outer one is a mix indeed.
  const SceneDescription s = clean_world(inner + mix("m", "\"i\" \"a\"", "") + use + "\nShape \"sphere\"");
  const auto& kept = std::get<MixMaterial>(s.materials.at(static_cast<size_t>(s.shapes.at(0).material)).kind);
  EXPECT_EQ(s.materials.at(static_cast<size_t>(kept.materials[0])).name, "b");
}

TEST_F(FoldConstants, MixesInACycleAreLeftToThoseWhoRefuseThem) {
  SceneDescription s;
  for (const int other : {1, 0}) s.materials.push_back({"m", MixMaterial{{other, other}, {0, -1}}, {}});
  s.shapes.emplace_back().material = 0;
  fold_constants(&s);
  EXPECT_GE(mix_in_a_cycle(s.materials), 0);
}

TEST_F(FoldConstants, LongChainsOfMixesTakeNoStack) {
  SceneDescription s;
  s.materials.push_back({"end", DiffuseMaterial{}, {}});
  for (int i = 0; i < 300000; ++i) s.materials.push_back({"m", MixMaterial{{i, 0}, {0, -1}}, {}});
  s.shapes.emplace_back().material = 300000;
  fold_constants(&s);
  EXPECT_EQ(s.shapes[0].material, 0);
}

TEST_F(FoldConstants, AlphaAndDisplacementByOneValue) {
  const SceneDescription s = clean_world(
      "Texture \"one\" \"float\" \"constant\"\n"
      "Material \"diffuse\" \"texture displacement\" \"one\"\nShape \"sphere\" \"texture alpha\" \"one\"");
  EXPECT_EQ(s.materials.back().displacement, -1);
  EXPECT_EQ(s.shapes.at(0).alpha.texture, -1);
  EXPECT_EQ(s.shapes.at(0).alpha.value, 1);
}

TEST_F(FoldConstants, Roughness) {
  const SceneDescription s = clean_world(
      "Texture \"r\" \"float\" \"constant\" \"float value\" 0.3\n"
      "Material \"conductor\" \"texture roughness\" \"r\"\nShape \"sphere\"");
  const auto& m = std::get<ConductorMaterial>(s.materials.back().kind);
  EXPECT_EQ(m.roughness.u.texture, -1);
  EXPECT_EQ(m.roughness.v.value, 0.3f);
}

}  // namespace
}  // namespace lightmill
