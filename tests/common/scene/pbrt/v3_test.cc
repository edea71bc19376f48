// Scenes of pbrt-v3 and v2: told apart by their words, and read as what pbrt-v4's --upgrade makes of them.
#include <cmath>

#include "common/scene/mesh/mesh_check.h"
#include "common/scene/pbrt/v3/dialect.h"
#include "common/scene/transform.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

class PbrtV3 : public SceneTest {
 protected:
  /// The world of a v3 file, with a sphere at its end.
  SceneDescription v3(const std::string& body, const std::string& options = "") {
    LoadResult r = load("Film \"image\" " + options + " WorldBegin LightSource \"point\"\n" + body +
                        "\nShape \"sphere\"\nWorldEnd");
    EXPECT_TRUE(r.ok()) << listed(r);
    EXPECT_EQ(r.scene.format, "pbrt-v3");
    messages = listed(r);
    return std::move(r.scene);
  }
  /// The material of the last shape.
  template <class Kind>
  Kind material(const std::string& body) {
    const SceneDescription scene = v3(body);
    const int index = scene.shapes.back().material;
    const auto* kind = std::get_if<Kind>(&scene.materials.at(static_cast<size_t>(index)).kind);
    EXPECT_NE(kind, nullptr) << body;
    return kind == nullptr ? Kind{} : *kind;
  }
  static void expect_rgb(const Rgb& c, float r, float g, float b) {
    EXPECT_FLOAT_EQ(c.r, r);
    EXPECT_FLOAT_EQ(c.g, g);
    EXPECT_FLOAT_EQ(c.b, b);
  }
  std::string messages;
};

std::optional<Dialect> told(const std::string& text) {
  return dialect_of(text, [](const std::string&) {});
}

TEST_F(PbrtV3, WordsTellTheDialect) {
  for (const char* text :
       {"Film \"image\"", "Material \"matte\"", "WorldBegin Texture \"t\" \"color\" \"constant\"",
        "MakeNamedMaterial \"m\" \"string type\" \"glass\"", "SurfaceIntegrator \"path\"",
        "LightSource \"infinite\" \"string mapname\" \"a.exr\"", "PixelFilter \"box\" \"float xwidth\" 1",
        "Material \"x\" \"color Kd\" [1 1 1]"})
    EXPECT_EQ(told(text), Dialect::kV3) << text;
  for (const char* text : {"Film \"rgb\"", "Material \"diffuse\"", "Option \"seed\" 3",
                           "Texture \"matte\" \"spectrum\" \"constant\"", "Sampler \"zsobol\"",
                           "MakeNamedMaterial \"glass\" \"string type\" \"dielectric\"",
                           "NamedMaterial \"mirror\" Texture \"color\" \"spectrum\" \"constant\""})
    EXPECT_EQ(told(text), Dialect::kV4) << text;
  for (const char* text :
       {"", "WorldBegin Shape \"sphere\"", "# Film \"image\"", "Film \"string a\" \"color x\""})
    EXPECT_EQ(told(text), std::nullopt) << text;
  EXPECT_EQ(clean_world("").format, "pbrt-v4") << "without a word that tells";
}

TEST_F(PbrtV3, IncludedFilesTellItToo) {
  folder_.write("geometry.pbrt", "Material \"matte\" Shape \"sphere\"");
  const LoadResult r = load("WorldBegin LightSource \"point\" Include \"geometry.pbrt\"");
  EXPECT_TRUE(r.ok());
  EXPECT_EQ(r.scene.format, "pbrt-v3");
}

TEST_F(PbrtV3, OptionsHaveTheirDefaultsAndNames) {
  SceneDescription s = v3("");
  EXPECT_EQ(s.film.width, 640);
  EXPECT_EQ(s.film.height, 480);
  EXPECT_EQ(s.filter.kind, FilterKind::kBox);
  EXPECT_EQ(s.film.imaging_ratio, 1);
  s = v3("", R"("float scale" 2 "integer xresolution" 32
    Camera "environment" "float shutterclose" 0.5
    PixelFilter "gaussian" "float xwidth" 1.5 "float ywidth" 1 "float alpha" 2
    Sampler "02sequence" "integer pixelsamples" 8
    Integrator "directlighting" "string strategy" "all")");
  EXPECT_EQ(s.film.width, 32);
  EXPECT_EQ(s.film.imaging_ratio, 2) << "the shutter is no exposure";
  EXPECT_EQ(s.camera.kind, CameraKind::kSpherical);
  EXPECT_EQ(s.camera.mapping, SphericalMapping::kEquirectangular);
  EXPECT_EQ(s.filter.xradius, 1.5);
  EXPECT_DOUBLE_EQ(s.filter.sigma, 0.5);
  EXPECT_EQ(s.sampling.spp, 8);
  EXPECT_EQ(s.sampling.max_depth, 1);
  EXPECT_NE(messages.find("is read as \"path\""), std::string::npos) << messages;
}

TEST_F(PbrtV3, DiffuseAndCoats) {
  expect_rgb(material<DiffuseMaterial>("Material \"matte\" \"color Kd\" [.1 .2 .3]").reflectance.value, .1f,
             .2f, .3f);
  const auto plastic = material<CoatedDiffuseMaterial>("Material \"plastic\"");
  expect_rgb(plastic.reflectance.value, .25f, .25f, .25f);
  EXPECT_FLOAT_EQ(plastic.roughness.u.value, 0.1f);
  material<DiffuseMaterial>("Material \"plastic\" \"rgb Ks\" [0 0 0]");
  const auto substrate = material<CoatedDiffuseMaterial>(
      "Material \"substrate\" \"float uroughness\" .2 \"float vroughness\" .3");
  EXPECT_FLOAT_EQ(substrate.roughness.u.value, .2f);
  EXPECT_FLOAT_EQ(substrate.roughness.v.value, .3f);
}

TEST_F(PbrtV3, MetalsAndGlass) {
  EXPECT_FLOAT_EQ(material<ConductorMaterial>("Material \"metal\"").roughness.u.value, 0.01f);
  EXPECT_FALSE(material<ConductorMaterial>("Material \"mirror\"").reflectance) << "silver";
  expect_rgb(
      material<ConductorMaterial>("Material \"mirror\" \"rgb Kr\" [.9 .8 .7]").reflectance.value().value, .9f,
      .8f, .7f);
  const auto glass = material<DielectricMaterial>("Material \"glass\" \"float index\" 1.33");
  EXPECT_FLOAT_EQ(glass.eta, 1.33f);
  EXPECT_EQ(glass.roughness.u.value, 0);
  EXPECT_EQ(messages, "");
  material<DielectricMaterial>("Material \"glass\" \"rgb Kt\" [1 .5 .5]");
  EXPECT_NE(messages.find("without its \"Kt\""), std::string::npos) << messages;
}

TEST_F(PbrtV3, UberIsTheNearestOfOurs) {
  material<CoatedDiffuseMaterial>("Material \"uber\"");
  material<DiffuseMaterial>("Material \"uber\" \"rgb Ks\" [0 0 0]");
  material<DielectricMaterial>("Material \"uber\" \"rgb Kd\" [0 0 0] \"rgb Kt\" [1 1 1] \"float index\" 1.3");
  EXPECT_EQ(material<CoatedDiffuseMaterial>("Material \"uber\" \"rgb Ks\" [0 0 0] \"rgb Kr\" [1 1 1]")
                .roughness.u.value,
            0);
  EXPECT_FLOAT_EQ(v3("Material \"uber\" \"rgb opacity\" [.4 .4 .4]").shapes.back().alpha.value, 0.4f);
  folder_.write("leaf.png", "");
  const SceneDescription s =
      v3("Texture \"leaf\" \"color\" \"imagemap\" \"string filename\" \"leaf.png\"\n"
         "Material \"uber\" \"texture opacity\" \"leaf\"");
  const int alpha = s.shapes.back().alpha.texture;
  ASSERT_GE(alpha, 0);
  EXPECT_FALSE(s.textures.at(static_cast<size_t>(alpha)).is_spectrum);
}

TEST_F(PbrtV3, TranslucentSharesItsColour) {
  const auto even = material<DiffuseTransmissionMaterial>("Material \"translucent\" \"rgb Kd\" [1 .5 0]");
  expect_rgb(even.reflectance.value, .5f, .25f, 0);
  expect_rgb(even.transmittance.value, .5f, .25f, 0);
  const auto through = material<DiffuseTransmissionMaterial>(
      "Material \"translucent\" \"rgb Kd\" [1 1 1] \"rgb reflect\" [0 0 0] \"rgb transmit\" [1 1 1]");
  expect_rgb(through.reflectance.value, 0, 0, 0);
  expect_rgb(through.transmittance.value, 1, 1, 1);
}

TEST_F(PbrtV3, MixesNameTheirMaterialsTheOtherWayRound) {
  const SceneDescription s =
      v3("MakeNamedMaterial \"a\" \"string type\" \"matte\"\nMakeNamedMaterial \"b\" \"string type\" "
         "\"mirror\"\n"
         "Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"rgb amount\" "
         "[.2 .2 .2]");
  const auto& mix = std::get<MixMaterial>(s.materials.at(static_cast<size_t>(s.shapes.back().material)).kind);
  EXPECT_EQ(s.materials.at(static_cast<size_t>(mix.materials[1])).name, "a");
  EXPECT_FLOAT_EQ(mix.amount.value, 0.2f);
}

TEST_F(PbrtV3, DisneyIsGltfsAndFourierIsNamed) {
  const auto m = material<MetallicRoughnessMaterial>(
      "Material \"disney\" \"color color\" [.3 .2 .1] \"float metallic\" .5 \"float roughness\" .2");
  expect_rgb(m.base_color.value, .3f, .2f, .1f);
  EXPECT_FLOAT_EQ(m.metallic.value, .5f);
  EXPECT_FLOAT_EQ(m.roughness.value, .2f);
  material<TransmissionMaterial>("Material \"disney\" \"float spectrans\" 1");
  material<DiffuseMaterial>("Material \"fourier\" \"string bsdffile\" \"a.bsdf\"");
  EXPECT_NE(messages.find("\"fourier\""), std::string::npos);
}

TEST_F(PbrtV3, LightsHaveTheirNamesAndScales) {
  SceneDescription s = v3("LightSource \"point\" \"rgb I\" [1 2 3] \"rgb scale\" [2 2 2]");
  expect_rgb(std::get<PointLight>(s.lights.back().kind).intensity, 2, 4, 6);
  s = v3("LightSource \"distant\" \"rgb L\" [1 2 3] \"rgb scale\" [2 1 0]");
  expect_rgb(std::get<DistantLight>(s.lights.back().kind).irradiance, 2, 2, 0);
  folder_.write("sky.exr", "");
  s = v3(
      "LightSource \"infinite\" \"rgb L\" [1 .5 .25] \"string mapname\" \"sky.exr\" \"integer nsamples\" 4");
  const auto& sky = std::get<InfiniteLight>(s.lights.back().kind);
  EXPECT_TRUE(sky.lat_long);
  expect_rgb(sky.radiance, 1, .5f, .25f);
  EXPECT_EQ(sky.light_to_world.m[2][1], 1) << "the panorama's top is +z";
  s = v3("AreaLightSource \"area\" \"blackbody L\" [5000 3]");
  const Rgb& c = s.area_lights.at(0).radiance;
  EXPECT_NEAR(0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b, 3, 1e-3);
}

TEST_F(PbrtV3, TexturesAreRenamedAndRedefined) {
  folder_.write("a.png", "");
  const SceneDescription s =
      v3("Texture \"t\" \"color\" \"imagemap\" \"string filename\" \"a.png\" \"bool gamma\" \"false\" "
         "\"bool trilinear\" \"true\"\n"
         "Texture \"u\" \"color\" \"scale\" \"texture tex2\" \"t\" \"rgb tex1\" [.5 .5 .5]\n"
         "Material \"matte\" \"texture Kd\" \"u\" Shape \"sphere\"\n"
         "Texture \"u\" \"color\" \"constant\" \"rgb value\" [.1 .2 .3]\n"
         "Material \"matte\" \"texture Kd\" \"u\"");
  EXPECT_EQ(messages, "");
  const auto texture_of = [&](const ShapeDescription& shape) -> const TextureDescription& {
    const auto& m = std::get<DiffuseMaterial>(s.materials.at(static_cast<size_t>(shape.material)).kind);
    return s.textures.at(static_cast<size_t>(m.reflectance.texture));
  };
  const auto& scale = std::get<ScaleTexture>(texture_of(s.shapes.at(0)).kind);
  EXPECT_FLOAT_EQ(scale.scale.value, 0.5f);
  const auto& image = std::get<ImageTexture>(s.textures.at(static_cast<size_t>(scale.tex.texture)).kind);
  EXPECT_EQ(image.encoding, ColorEncoding::kLinear);
  const auto& last =
      std::get<DiffuseMaterial>(s.materials.at(static_cast<size_t>(s.shapes.back().material)).kind);
  expect_rgb(last.reflectance.value, .1f, .2f, .3f);
}

TEST_F(PbrtV3, ShapesHaveTheirNames) {
  const SceneDescription s =
      v3("Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 1 0] "
         "\"float st\" [0 0 1 0 0 1] \"bool discarddegenerateUVs\" \"true\"\n"
         "Shape \"loopsubdiv\" \"integer nlevels\" 1 \"integer indices\" [0 1 2] \"point P\" [0 0 0 1 0 0 0 "
         "1 0]");
  EXPECT_EQ(messages, "");
  EXPECT_EQ(std::get<MeshShape>(s.shapes.at(0).kind).mesh->uvs.size(), 3u);
  EXPECT_EQ(std::get<MeshShape>(s.shapes.at(1).kind).mesh->triangles.size(), 4u);
}

TEST_F(PbrtV3, ItsShapesHaveTheirAreas) {
  const std::pair<const char*, double> cases[] = {
      {"\"cone\" \"float radius\" 2 \"float height\" 3", M_PI * 2 * std::sqrt(13.0)},
      {"\"paraboloid\" \"float radius\" 1 \"float zmax\" 1", M_PI / 6 * (std::pow(5, 1.5) - 1)},
      {"\"hyperboloid\" \"point p1\" [1 0 0] \"point p2\" [1 0 2]", 2 * M_PI * 2},  // a cylinder
      {"\"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \"float Pz\" [0 1 0 1]", std::sqrt(2.0)},
  };
  for (const auto& [text, area] : cases) {
    const SceneDescription s = v3("Shape " + std::string(text));
    ASSERT_EQ(s.shapes.size(), 2u) << text;
    EXPECT_NEAR(mesh_area(*std::get<MeshShape>(s.shapes[0].kind).mesh, {}), area, 1e-3 * area) << text;
  }
}

TEST_F(PbrtV3, NurbsAreRational) {
  // A quarter of a cylinder of radius 1 and height 2: its arc is a rational parabola.
  const std::string surface =
      "Shape \"nurbs\" \"integer nu\" 3 \"integer uorder\" 3 \"float uknots\" [0 0 0 1 1 1]\n"
      "\"integer nv\" 2 \"integer vorder\" 2 \"float vknots\" [0 0 1 1]\n";
  const double w = std::sqrt(0.5);
  const std::string s = std::to_string(w), z = std::to_string(2 * w);
  const SceneDescription scene = v3(surface + "\"float Pw\" [1 0 0 1 " + s + " " + s + " 0 " + s +
                                    " 0 1 0 1\n 1 0 2 1 " + s + " " + s + " " + z + " " + s + " 0 1 2 1]");
  EXPECT_EQ(messages, "");
  ASSERT_EQ(scene.shapes.size(), 2u);
  const TriangleMesh& mesh = *std::get<MeshShape>(scene.shapes[0].kind).mesh;
  EXPECT_NEAR(mesh_area(mesh, {}), M_PI, 1e-3 * M_PI);
  for (size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3f &p = mesh.positions[i], &n = mesh.normals[i];
    EXPECT_NEAR(std::hypot(p.x, p.y), 1, 1e-5);
    EXPECT_NEAR(n.x * p.x + n.y * p.y, 1, 1e-4) << "dp/du x dp/dv";
  }
  const SceneDescription part =
      v3(surface + "\"float u1\" 0.5 \"point P\" [0 0 0 1 0 0 2 0 0  0 1 0 1 1 0 2 1 0]");
  EXPECT_NEAR(mesh_area(*std::get<MeshShape>(part.shapes[0].kind).mesh, {}), 1, 1e-5);
  EXPECT_EQ(v3(surface + "\"point P\" [0 0 0]").shapes.size(), 1u) << "left out";
  EXPECT_NE(messages.find("needs nu x nv points"), std::string::npos) << messages;
  v3("Shape \"nurbs\" \"integer nu\" 3 \"integer uorder\" 5 \"float uknots\" [0 1]");
  EXPECT_NE(messages.find("an order of at least 2"), std::string::npos) << messages;
}

TEST_F(PbrtV3, WhatOnlyV2HasIsLeftOut) {
  const LoadResult r = load(
      "Renderer \"sampler\" SurfaceIntegrator \"path\" \"integer maxdepth\" 7 VolumeIntegrator \"single\"\n"
      "WorldBegin LightSource \"point\" Volume \"homogeneous\" Material \"shinymetal\" Shape \"sphere\" "
      "WorldEnd");
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_EQ(r.scene.sampling.max_depth, 7);
  EXPECT_TRUE(mentions(r, "VolumeIntegrator is pbrt-v2's and is left out"));
  material<DiffuseMaterial>("Material \"measured\" \"string filename\" \"brdfs/mystique.brdf\"");
  EXPECT_NE(messages.find("of pbrt-v2 is rendered grey"), std::string::npos) << messages;
}

TEST_F(PbrtV3, ItsMaterialsAreReadInV4FilesToo) {
  const LoadResult r =
      load("Film \"rgb\" WorldBegin LightSource \"point\" Material \"plastic\" Shape \"sphere\"");
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "material \"plastic\" is pbrt-v3's"));
}

}  // namespace
}  // namespace lightmill
