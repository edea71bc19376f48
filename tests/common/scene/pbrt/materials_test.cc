// Materials, textures, lights.
#include <cmath>
#include <numbers>

#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class Materials : public SceneTest {
 protected:
  template <class T>
  T last(const SceneDescription& scene) {
    return std::get<T>(scene.materials.back().kind);
  }
};

TEST_F(Materials, Defaults) {
  EXPECT_EQ(last<DiffuseMaterial>(clean_world("Material \"diffuse\"")).reflectance.value,
            (Rgb{0.5f, 0.5f, 0.5f}));
  const auto glass = last<DielectricMaterial>(clean_world("Material \"dielectric\""));
  EXPECT_EQ(glass.eta, 1.5f);
  EXPECT_EQ(glass.roughness.u.value, 0);
  EXPECT_TRUE(glass.roughness.remap);
  const auto metal = last<ConductorMaterial>(clean_world("Material \"conductor\""));
  EXPECT_NEAR(metal.eta.value.r, 0.2004, 1e-3) << "copper";
  EXPECT_FALSE(metal.reflectance);
  const auto coat =
      last<CoatedDiffuseMaterial>(clean_world("Material \"coateddiffuse\" \"float thickness\" 0.1"));
  EXPECT_EQ(coat.eta, 1.5f);
  EXPECT_EQ(coat.roughness.v.value, 0);
}

TEST_F(Materials, HairIsByPigmentsAbsorptionOrReflectance) {
  const auto brown = last<HairMaterial>(clean_world("Material \"hair\""));
  EXPECT_NEAR(brown.sigma_a.value.r, 1.3 * 0.419, 1e-6);
  EXPECT_FALSE(brown.reflectance);
  EXPECT_EQ(brown.eta, 1.55f);
  const auto red =
      last<HairMaterial>(clean_world("Material \"hair\" \"float pheomelanin\" 2 \"float beta_m\" 0"));
  EXPECT_NEAR(red.sigma_a.value.b, 2.1, 1e-6) << "eumelanin is 0 where the other pigment is given";
  EXPECT_EQ(red.beta_m, 0.01f);
  const auto given = last<HairMaterial>(
      clean_world("Material \"hair\" \"rgb sigma_a\" [1 2 3] \"rgb reflectance\" [.5 .5 .5]"));
  EXPECT_EQ(given.sigma_a.value, (Rgb{1, 2, 3}));
  EXPECT_FALSE(given.reflectance);
  EXPECT_TRUE(last<HairMaterial>(clean_world("Material \"hair\" \"rgb color\" [.5 .2 .1]")).reflectance);
}

TEST_F(Materials, SubsurfaceIsByNameCoefficientsOrReflectance) {
  const auto of = [&](const std::string& p) {
    return last<SubsurfaceMaterial>(clean_world("Material \"subsurface\" " + p));
  };
  const SubsurfaceMaterial plain = of("\"float scale\" 2");
  EXPECT_EQ(plain.sigma_s, (Rgb{5.1f, 6.42f, 7.54f}));
  EXPECT_EQ(plain.eta, 1.33f);
  EXPECT_EQ(plain.roughness.u.value, 0);
  EXPECT_FALSE(plain.reflectance);
  const SubsurfaceMaterial marble = of("\"string name\" \"Marble\" \"float scale\" 10");
  EXPECT_NEAR(marble.sigma_s.g, 26.2f, 1e-5f);
  EXPECT_EQ(marble.g, 0);
  const SubsurfaceMaterial given = of("\"rgb sigma_a\" [1 2 3] \"rgb sigma_s\" [4 5 6] \"float g\" 0.5");
  EXPECT_EQ(given.sigma_a, (Rgb{1, 2, 3}));
  EXPECT_EQ(given.sigma_s, (Rgb{4, 5, 6}));
  EXPECT_EQ(given.g, 0.5f);
  const SubsurfaceMaterial skin =
      of("\"rgb reflectance\" [.8 .5 .3] \"rgb mfp\" [1 2 4] \"float scale\" .5 \"float eta\" 1.4");
  ASSERT_TRUE(skin.reflectance);
  EXPECT_EQ(skin.reflectance->value, (Rgb{.8f, .5f, .3f}));
  EXPECT_EQ(skin.mfp, (Rgb{.5f, 1, 2})) << "which the scale is of";
  EXPECT_EQ(skin.eta, 1.4f);
  EXPECT_GE(last<SubsurfaceMaterial>(clean_world("Texture \"t\" \"spectrum\" \"checkerboard\" Material "
                                                 "\"subsurface\" \"texture reflectance\" \"t\""))
                .reflectance->texture,
            0);
  const auto fails = [&](const std::string& p, const std::string& message) {
    EXPECT_TRUE(has_error(strictly_world("Material \"subsurface\" " + p), message));
  };
  fails("\"string name\" \"Milk\"", "names no measured medium");
  fails("\"rgb sigma_a\" [1 1 1]", "needs \"sigma_s\" beside it");
  fails("\"rgb reflectance\" [.5 .5 .5] \"rgb mfp\" [1 0 1]", "must be above 0");
  fails("\"rgb reflectance\" [.5 .5 .5] \"float scale\" 0", "must be above 0");
  EXPECT_TRUE(mentions(load_world("Material \"subsurface\" \"string name\" \"Marble\" \"float g\" .3"),
                       "does not count beside"));
}

TEST_F(Materials, RoughnessSetsBothDirections) {
  auto m = last<ConductorMaterial>(
      clean_world("Material \"conductor\" \"float roughness\" 0.3 \"bool remaproughness\" false"));
  EXPECT_FLOAT_EQ(m.roughness.u.value, 0.3f);
  EXPECT_FLOAT_EQ(m.roughness.v.value, 0.3f);
  EXPECT_FALSE(m.roughness.remap);
  m = last<ConductorMaterial>(
      clean_world("Material \"conductor\" \"float roughness\" 0.3 \"float vroughness\" 0.1"));
  EXPECT_FLOAT_EQ(m.roughness.u.value, 0.3f);
  EXPECT_FLOAT_EQ(m.roughness.v.value, 0.1f);
}

TEST_F(Materials, ConductorByReflectance) {
  const auto m =
      last<ConductorMaterial>(clean_world("Material \"conductor\" \"rgb reflectance\" [0.9 0.8 0.7]"));
  ASSERT_TRUE(m.reflectance);
  EXPECT_FLOAT_EQ(m.reflectance->value.g, 0.8f);
  EXPECT_TRUE(
      has_error(strictly_world("Material \"conductor\" \"rgb reflectance\" [0.9 0.8 0.7] \"rgb k\" [1 1 1]"),
                "together"));
}

TEST_F(Materials, NamedGlassIsANumber) {
  const LoadResult r = load_world("Material \"dielectric\" \"spectrum eta\" \"glass-F11\"");
  EXPECT_TRUE(r.ok());
  EXPECT_FLOAT_EQ(last<DielectricMaterial>(r.scene).eta, 1.7847f);
  const LoadResult same = load_world("Material \"dielectric\" \"spectrum eta\" \"glass-SF11\"");
  EXPECT_FLOAT_EQ(last<DielectricMaterial>(same.scene).eta, 1.7847f);
  const SceneDescription grey = clean_world("Material \"dielectric\" \"rgb eta\" [1.4 1.4 1.4]");
  EXPECT_FLOAT_EQ(last<DielectricMaterial>(grey).eta, 1.4f);
}

TEST_F(Materials, ThinDielectric) {
  EXPECT_EQ(last<ThinDielectricMaterial>(clean_world("Material \"thindielectric\"")).eta, 1.5f);
  const LoadResult r = load_world("Material \"thindielectric\" \"spectrum eta\" \"glass-F11\"");
  EXPECT_TRUE(r.ok());
  EXPECT_FLOAT_EQ(last<ThinDielectricMaterial>(r.scene).eta, 1.7847f);
  EXPECT_TRUE(has_error(strictly_world("Material \"thindielectric\" \"float eta\" 0"), "must be at least"));
}

TEST_F(Materials, CoatedConductor) {
  const auto plain = last<CoatedConductorMaterial>(clean_world("Material \"coatedconductor\""));
  EXPECT_NEAR(plain.conductor.eta.value.r, 0.2004, 1e-3) << "copper";
  EXPECT_EQ(plain.eta, 1.5f);
  EXPECT_FLOAT_EQ(plain.thickness, 0.01f);
  EXPECT_EQ(plain.max_depth, 10);
  const LoadResult layered = load_world(R"(Material "coatedconductor"
    "float interface.roughness" 0.1 "float interface.vroughness" 0.2 "float interface.eta" 1.3
    "float conductor.roughness" 0.4 "spectrum conductor.eta" "metal-Au-eta" "spectrum conductor.k" "metal-Au-k"
    "float thickness" 0.5 "integer maxdepth" 20 "integer nsamples" 4 "float g" 0.2 "bool remaproughness" false)");
  EXPECT_TRUE(layered.ok());
  EXPECT_TRUE(layered.problems.empty());
  const auto m = last<CoatedConductorMaterial>(layered.scene);
  EXPECT_FLOAT_EQ(m.coat_roughness.u.value, 0.1f);
  EXPECT_FLOAT_EQ(m.coat_roughness.v.value, 0.2f);
  EXPECT_FALSE(m.coat_roughness.remap);
  EXPECT_FLOAT_EQ(m.conductor.roughness.v.value, 0.4f);
  EXPECT_FALSE(m.conductor.roughness.remap);
  EXPECT_FLOAT_EQ(m.eta, 1.3f);
  EXPECT_EQ(m.max_depth, 20);
  EXPECT_TRUE(last<CoatedConductorMaterial>(
                  clean_world("Material \"coatedconductor\" \"rgb reflectance\" [0.9 0.5 0.1]"))
                  .conductor.reflectance);
  EXPECT_TRUE(
      has_error(strictly_world("Material \"coatedconductor\" \"float interface.eta\" 0"), "at least"));
  EXPECT_TRUE(has_error(strictly_world("Material \"coatedconductor\" \"float conductor.roughness\" -1"),
                        "at least 0"));
  EXPECT_TRUE(has_error(strictly_world("Material \"coatedconductor\" \"float roughness\" 1"), "roughness"));
}

TEST_F(Materials, CoatsThatScatter) {
  const auto m = last<CoatedDiffuseMaterial>(
      clean_world("Material \"coateddiffuse\" \"rgb albedo\" [0.1 0.2 0.3] \"float g\" 0.4"));
  EXPECT_NEAR(m.medium.albedo.g, 0.2, 1e-5);
  EXPECT_FLOAT_EQ(m.medium.g, 0.4f);
  const std::string board = "Texture \"t\" \"spectrum\" \"checkerboard\" ";
  EXPECT_TRUE(
      mentions(load_world(board + "Material \"coateddiffuse\" \"texture albedo\" \"t\""), "one colour"));
  const LoadResult textured = load_world(
      board + "Material \"coatedconductor\" \"rgb albedo\" [0.1 0.2 0.3] \"texture reflectance\" \"t\"");
  EXPECT_TRUE(mentions(textured, "is ignored over a metal"));
  EXPECT_EQ(last<CoatedConductorMaterial>(textured.scene).medium.albedo, Rgb{});
  EXPECT_TRUE(has_error(strictly_world("Material \"coateddiffuse\" \"float g\" 1"), "at most"));
}

TEST_F(Materials, Mix) {
  const std::string two =
      "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" MakeNamedMaterial \"b\" \"string type\" "
      "\"conductor\" ";
  const SceneDescription s =
      clean_world(two + "Material \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" 0.3");
  const auto m = last<MixMaterial>(s);
  EXPECT_EQ(s.materials[static_cast<size_t>(m.materials[0])].name, "a");
  EXPECT_EQ(s.materials[static_cast<size_t>(m.materials[1])].name, "b");
  EXPECT_FLOAT_EQ(m.amount.value, 0.3f);
  EXPECT_TRUE(
      has_error(strictly_world(two + "Material \"mix\" \"string materials\" [\"a\"]"), "two materials"));
  EXPECT_TRUE(has_error(strictly_world(two + "Material \"mix\" \"string materials\" [\"a\" \"c\"]"),
                        "no material named \"c\""));
  EXPECT_TRUE(has_error(
      strictly_world(two + "Material \"mix\" \"string materials\" [\"a\" \"b\"] \"float amount\" 2"),
      "amount"));
  EXPECT_TRUE(has_error(
      strictly_world("MakeNamedMaterial \"a\" \"string type\" \"mix\" \"string materials\" [\"b\" \"b\"]"
                     " MakeNamedMaterial \"b\" \"string type\" \"mix\" \"string materials\" [\"a\" \"a\"]"),
      "contains itself"));
}

TEST_F(Materials, DiffuseTransmission) {
  const auto plain = last<DiffuseTransmissionMaterial>(clean_world("Material \"diffusetransmission\""));
  EXPECT_EQ(plain.reflectance.value, (Rgb{0.25f, 0.25f, 0.25f}));
  EXPECT_EQ(plain.transmittance.value, (Rgb{0.25f, 0.25f, 0.25f}));
  const auto leaf = last<DiffuseTransmissionMaterial>(
      clean_world("Material \"diffusetransmission\" \"rgb reflectance\" [0.1 0.2 0.1] \"rgb transmittance\" "
                  "[0.1 0.3 0.1] \"float scale\" 2"));
  EXPECT_FLOAT_EQ(leaf.transmittance.value.g, 0.3f);
  EXPECT_EQ(leaf.scale, 2);
  const LoadResult r = load_world("Material \"diffusetransmission\" \"float scale\" 4");
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "scaled down to a sum of 1"));
}

TEST_F(Materials, Textures) {
  folder_.write("a b.png", "not really a picture");
  const SceneDescription s = clean_world(R"(
    Texture "img" "spectrum" "imagemap" "string filename" "a b.png" "string wrap" "clamp" "string encoding" "gamma 1.8"
      "float scale" 2 "bool invert" true "float uscale" 3 "float vdelta" 0.5 "string filter" "trilinear"
    Texture "rough" "float" "constant" "float value" 0.2
    Texture "dim" "spectrum" "scale" "texture tex" "img" "float scale" 0.5
    Texture "mix" "spectrum" "mix" "texture tex1" "img" "rgb tex2" [0 1 0] "texture amount" "rough"
    Texture "board" "spectrum" "checkerboard" "rgb tex1" [1 0 0] "texture tex2" "mix" "float uscale" 4
    Material "coateddiffuse" "texture reflectance" "board" "texture roughness" "rough"
    Shape "sphere")");
  ASSERT_EQ(s.textures.size(), 5u);
  const auto& image = std::get<ImageTexture>(s.textures[0].kind);
  EXPECT_EQ(std::filesystem::path(image.path).filename(), "a b.png");
  EXPECT_EQ(image.wrap, Wrap::kClamp);
  EXPECT_EQ(image.encoding, ColorEncoding::kGamma);
  EXPECT_FLOAT_EQ(image.gamma, 1.8f);
  EXPECT_FLOAT_EQ(image.scale, 2);
  EXPECT_TRUE(image.invert);
  EXPECT_EQ(image.filter, TexelFilter::kBilinear);
  EXPECT_FLOAT_EQ(image.mapping.su, 3);
  EXPECT_FLOAT_EQ(image.mapping.dv, 0.5f);
  EXPECT_FALSE(s.textures[1].is_spectrum);
  EXPECT_EQ(std::get<ScaleTexture>(s.textures[2].kind).tex.texture, 0);
  EXPECT_EQ(std::get<MixTexture>(s.textures[3].kind).amount.texture, 1);
  EXPECT_EQ(std::get<CheckerboardTexture>(s.textures[4].kind).tex2.texture, 3);
  const auto m = last<CoatedDiffuseMaterial>(s);
  EXPECT_EQ(m.reflectance.texture, 4);
  EXPECT_FLOAT_EQ(m.roughness.u.value, 0.2f);
  EXPECT_FLOAT_EQ(m.roughness.v.value, 0.2f);
  EXPECT_EQ(s.files.back().name, "a b.png");
}

TEST_F(Materials, TexelsAreShownIfTheFilterIsAPoint) {
  folder_.write("a.png", "not really a picture");
  const auto texture = [](const std::string& filter) {
    return "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\" \"string filter\" \"" +
           filter + "\"";
  };
  EXPECT_EQ(std::get<ImageTexture>(clean_world(texture("point")).textures[0].kind).filter,
            TexelFilter::kNearest);
  EXPECT_TRUE(refused_on_line_2(strictly_world(texture("points")), "did you mean \"point\"?"));
}

TEST_F(Materials, TextureMistakes) {
  EXPECT_TRUE(has_error(strictly_world("Material \"diffuse\" \"texture reflectance\" \"none\""),
                        "no spectrum texture named \"none\""));
  EXPECT_TRUE(has_error(strictly_world("Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"t\""),
                        "not defined above"));
  EXPECT_TRUE(
      has_error(strictly_world("Texture \"t\" \"rgb\" \"constant\""), "of type \"float\" or \"spectrum\""));
  EXPECT_TRUE(has_error(strictly_world("Texture \"t\" \"float\" \"constnt\""), "did you mean \"constant\"?"));
  EXPECT_TRUE(
      has_error(strictly_world("Texture \"t\" \"float\" \"constant\" Texture \"t\" \"float\" \"constant\""),
                "defined twice"));
  EXPECT_TRUE(
      has_error(strictly_world("Texture \"t\" \"float\" \"imagemap\""), "needs a \"string filename\""));
  EXPECT_TRUE(has_error(strictly_world("Texture \"t\" \"float\" \"imagemap\" \"string filename\" \"no.png\""),
                        "2:32: there is no file \"no.png\""));
}

TEST_F(Materials, Mistakes) {
  EXPECT_TRUE(has_error(strictly_world("Material \"diffus\""), "did you mean \"diffuse\"?"));
  EXPECT_TRUE(mentions(load_world("Material \"diffuse\" Material \"matte\""), "is pbrt-v3's"));
  EXPECT_TRUE(
      has_error(strictly_world("Material \"diffuse\" \"rgb reflectance\" [1.5 0 0]"), "within [0, 1]"));
  EXPECT_TRUE(has_error(strictly_world("Material \"diffuse\" \"rgb reflectance\" [0.5 0.5]"), "rgb needs 3"));
  EXPECT_TRUE(has_error(strictly_world("Material \"dielectric\" \"float eta\" -1"), "must be at least"));
  EXPECT_TRUE(
      has_error(strictly_world("Material \"conductor\" \"float roughness\" -0.1"), "must be at least 0"));
  EXPECT_TRUE(has_error(strictly_world("Material \"conductor\" \"rgb eta\" [0 1 1] \"rgb k\" [0 1 1]"),
                        "must be above 0 where k is 0"));
  EXPECT_TRUE(
      mentions(load_world("Material \"conductor\" \"float roughness\" 3"), "the roughest surface has 1"));
  EXPECT_TRUE(has_error(strictly_world("NamedMaterial \"x\" Shape \"sphere\""), "no material named \"x\""));
  EXPECT_TRUE(has_error(strictly_world("MakeNamedMaterial \"x\""), "needs a \"string type\""));
  EXPECT_TRUE(
      has_error(strictly_world("MakeNamedMaterial \"x\" \"string type\" \"diffuse\" MakeNamedMaterial "
                               "\"x\" \"string type\" \"diffuse\""),
                "defined twice"));
}

TEST_F(Materials, PointAndInfiniteLights) {
  const SceneDescription s = clean_world(R"(
    Translate 1 2 3
    LightSource "point" "rgb I" [1 2 3] "float scale" 2 "point3 from" [0 0 1]
    LightSource "point" "float power" 100
    LightSource "infinite" "rgb L" [0.1 0.2 0.3] "float scale" 10
    LightSource "infinite" "float illuminance" 6)");
  const auto& point = std::get<PointLight>(s.lights.at(1).kind);
  EXPECT_EQ(point.intensity, (Rgb{2, 4, 6}));
  EXPECT_EQ(point.position.z, 4);
  EXPECT_NEAR(std::get<PointLight>(s.lights.at(2).kind).intensity.g, 100 / (4 * std::numbers::pi), 1e-4);
  EXPECT_EQ(std::get<InfiniteLight>(s.lights.at(3).kind).radiance, (Rgb{1, 2, 3}));
  EXPECT_NEAR(std::get<InfiniteLight>(s.lights.at(4).kind).radiance.b, 6 / std::numbers::pi, 1e-5);
}

TEST_F(Materials, AreaLightPower) {
  // One triangle of area 2 (scaled): L = power / (pi A).
  const SceneDescription s = clean_world(R"(
    Scale 2 1 1
    AreaLightSource "diffuse" "float power" 10
    Shape "trianglemesh" "point3 P" [0 0 0 2 0 0 0 1 0]
    AreaLightSource "diffuse" "float power" 10 "bool twosided" true
    Shape "trianglemesh" "point3 P" [0 0 0 2 0 0 0 1 0])");
  EXPECT_NEAR(s.area_lights.at(0).radiance.r, 10 / (std::numbers::pi * 2), 1e-5);
  EXPECT_NEAR(s.area_lights.at(1).radiance.r, 10 / (std::numbers::pi * 4), 1e-5);
}

TEST_F(Materials, ShapesShareOneAreaLight) {
  const SceneDescription s = clean_world("AreaLightSource \"diffuse\" Shape \"sphere\" Shape \"sphere\"");
  EXPECT_EQ(s.area_lights.size(), 1u);
  EXPECT_EQ(s.shapes[0].area_light, s.shapes[1].area_light);
}

TEST_F(Materials, ASceneWithoutLightIsRefused) {
  EXPECT_TRUE(has_error(strictly("WorldBegin Shape \"sphere\""), "no light"));
}

}  // namespace
}  // namespace lightmill
