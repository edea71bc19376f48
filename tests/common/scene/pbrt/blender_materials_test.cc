// Materials that are Blender's shader nodes, and what transparent ones do to shapes.
#include <gmock/gmock.h>

#include "common/scene/possible_strategies.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

using testing::HasSubstr;

class BlenderMaterials : public SceneTest {
 protected:
  static constexpr const char* kTriangle =
      " Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]";
  static std::string named(const std::string& name, const std::string& type, const std::string& more = "") {
    return "MakeNamedMaterial \"" + name + "\" \"string type\" \"" + type + "\" " + more + "\n";
  }
  static std::string shown(const std::string& name) { return "NamedMaterial \"" + name + "\"" + kTriangle; }
  static std::string mixed(const std::string& type, const std::string& more = "") {
    return named("both", type, "\"string materials\" [\"a\" \"b\"] " + more);
  }
};

TEST_F(BlenderMaterials, EveryTypeIsRead) {
  for (const char* type : {"principled", "diffuse_bsdf", "glossy_bsdf", "glass_bsdf", "refraction_bsdf",
                           "translucent_bsdf", "transparent_bsdf", "velvet_bsdf", "toon_bsdf", "holdout",
                           "subsurface_bsdf", "principled_hair_bsdf"}) {
    SCOPED_TRACE(type);
    EXPECT_FALSE(clean_world(named("m", type) + shown("m")).shapes.empty());
  }
  for (const char* type : {"mix_bsdf", "add_bsdf"}) {
    SCOPED_TRACE(type);
    clean_world(named("a", "diffuse_bsdf") + named("b", "glossy_bsdf") + mixed(type) + shown("both"));
  }
}

TEST_F(BlenderMaterials, PrincipledIsMadeOfItsParts) {
  const auto kind = [&](const std::string& parameters) {
    const SceneDescription s = clean_world(named("m", "principled", parameters) + shown("m"));
    return s.materials.at(static_cast<size_t>(s.shapes.at(0).material)).kind;
  };
  const MaterialKind plain = kind("");
  const auto& opaque = std::get<PrincipledMaterial>(plain);
  EXPECT_EQ(opaque.base_color.value, (Rgb{0.8f, 0.8f, 0.8f}));
  EXPECT_EQ(opaque.ior.value, 1.45f);
  EXPECT_EQ(std::get<MixMaterial>(kind("\"float transmission\" 1")).rule, MixRule::kTransmission);
  EXPECT_EQ(std::get<MixMaterial>(kind("\"float subsurface\" .5")).rule, MixRule::kBody);
}

TEST_F(BlenderMaterials, TransparentPartsBecomeAlphaMasks) {
  const std::string parts = named("a", "transparent_bsdf") + named("b", "diffuse_bsdf");
  const SceneDescription s = clean_world(parts + mixed("mix_bsdf", "\"float factor\" .25") + shown("both"));
  EXPECT_FLOAT_EQ(s.shapes.at(0).alpha.value, 0.25f);
  const SceneDescription by_texture =
      clean_world("Texture \"t\" \"float\" \"fbm\"\n" + parts +
                  mixed("mix_bsdf", "\"texture factor\" \"t\"") + shown("both"));
  EXPECT_GE(by_texture.shapes.at(0).alpha.texture, 0);
  const SceneDescription whole = clean_world(parts + shown("a"));
  EXPECT_FLOAT_EQ(whole.shapes.at(0).alpha.value, 0);
  // A sum with what lets all pass is still met now and then.
  const SceneDescription sum = clean_world(parts + mixed("add_bsdf") + shown("both"));
  EXPECT_GT(sum.shapes.at(0).alpha.value, 0);
  EXPECT_LT(sum.shapes.at(0).alpha.value, 0.1f);
}

TEST_F(BlenderMaterials, AColourOfTransparentPartsIsATint) {
  const SceneDescription s =
      clean_world(named("a", "transparent_bsdf", "\"rgb color\" [.9 .5 .2]") + named("b", "diffuse_bsdf") +
                  mixed("mix_bsdf", "\"float factor\" .25") + shown("both"));
  const MaterialDescription& m = s.materials.at(static_cast<size_t>(s.shapes.at(0).material));
  EXPECT_EQ(m.tint, (Rgb{0.9f, 0.5f, 0.2f}));
  EXPECT_FLOAT_EQ(m.opacity.value, 0.25f);
  EXPECT_FLOAT_EQ(s.shapes.at(0).alpha.value, 1);
}

TEST_F(BlenderMaterials, RayNodesLeaveCameraPathsAlone) {
  folder_.write(
      "g.json",
      R"({"texture_graph": 1, "nodes": [{"name": "n", "type": "FRESNEL"}], "output": ["n", "Fac"]})");
  const SceneDescription s = clean_world(
      "Texture \"t\" \"float\" \"graph\" \"string filename\" \"g.json\"\n" + named("a", "glossy_bsdf") +
      named("b", "diffuse_bsdf") + mixed("mix_bsdf", "\"texture factor\" \"t\"") + shown("both"));
  const PossibleStrategies possible = possible_strategies(s);
  EXPECT_EQ(possible.set & kLightPaths, 0u);
  EXPECT_THAT(possible.why_no_more, HasSubstr("Fresnel"));
}

// Glass for all rays but those to lights, the usual window of Blender's rooms.
TEST_F(BlenderMaterials, AColourThatOnlySomeRaysPassIsGrey) {
  folder_.write(
      "g.json",
      R"({"texture_graph": 1, "nodes": [{"name": "n", "type": "LIGHT_PATH"}], "output": ["n", "Is Shadow Ray"]})");
  const LoadResult r =
      load_world("Texture \"t\" \"float\" \"graph\" \"string filename\" \"g.json\"\n" +
                 named("a", "glass_bsdf") + named("b", "transparent_bsdf", "\"rgb color\" [1 0.5 0]") +
                 mixed("mix_bsdf", "\"texture factor\" \"t\"") + shown("both"));
  EXPECT_TRUE(mentions(r, "depends on the ray is taken as grey")) << listed(r);
  const ShapeDescription& shape = r.scene.shapes.at(0);
  const MaterialDescription& m = r.scene.materials.at(static_cast<size_t>(shape.material));
  EXPECT_EQ(m.tint, (Rgb{1, 1, 1}));
  ASSERT_GE(shape.alpha.texture, 0);
  const auto& outer =
      std::get<MixTexture>(r.scene.textures.at(static_cast<size_t>(shape.alpha.texture)).kind);
  EXPECT_NEAR(outer.amount.value, 0.5f, 1e-6f);
}

TEST_F(BlenderMaterials, WhatIsUnknownIsSaid) {
  const auto complaint = [&](const std::string& text) {
    const LoadResult r = load_world(text + shown("m"));
    return r.problems.empty() ? std::string() : r.problems.at(0).message;
  };
  EXPECT_THAT(complaint(named("m", "glossy_bsdf", "\"string distribution\" \"phong\"")), HasSubstr("phong"));
  EXPECT_THAT(complaint(named("m", "principled", "\"float shininess\" 1")), HasSubstr("shininess"));
  EXPECT_THAT(complaint(named("m", "mix_bsdf")), HasSubstr("needs the names of two materials"));
}

}  // namespace
}  // namespace lightmill
