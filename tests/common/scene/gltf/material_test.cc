// glTF materials and textures.
#include <cmath>

#include "tests/common/scene/gltf/gltf_fixture.h"

namespace lightmill {
namespace {

using nlohmann::json;

class GltfMaterialTest : public GltfTest {
 protected:
  GltfMaterialTest() {
    document_["images"] = {{{"uri", "paint.png"}}};
    document_["textures"] = {{{"source", 0}}};
    folder_.write("paint.png", "not read by the reader");
  }
  json& material() { return document_["materials"][0]; }
  /// The material that the shape has, of one kind.
  template <class Kind>
  Kind only(const SceneDescription& s) {
    return std::get<Kind>(s.materials.at(static_cast<size_t>(s.shapes.at(0).material)).kind);
  }
  static const ImageTexture& image(const SceneDescription& s, int texture) {
    return std::get<ImageTexture>(s.textures.at(static_cast<size_t>(texture)).kind);
  }
};

TEST_F(GltfMaterialTest, Defaults) {
  const auto m = only<MetallicRoughnessMaterial>(clean_document());
  EXPECT_EQ(m.base_color.value, (Rgb{1, 1, 1}));
  EXPECT_EQ(m.metallic.value, 1);
  EXPECT_EQ(m.roughness.value, 1);
  EXPECT_EQ(m.ior, 1.5f);
}

TEST_F(GltfMaterialTest, FactorsAndTexturesMultiply) {
  material()["pbrMetallicRoughness"] = json::parse(R"({
    "baseColorFactor": [0.5, 1, 1, 1], "baseColorTexture": {"index": 0},
    "metallicFactor": 0.25, "roughnessFactor": 0.5, "metallicRoughnessTexture": {"index": 0}})");
  const SceneDescription s = clean_document();
  const auto m = only<MetallicRoughnessMaterial>(s);
  const auto& product =
      std::get<ProductTexture>(s.textures.at(static_cast<size_t>(m.base_color.texture)).kind);
  EXPECT_EQ(product.b.value, (Rgb{0.5f, 1, 1}));
  EXPECT_EQ(image(s, product.a.texture).encoding, ColorEncoding::kSrgb);
  const ImageTexture& metal = image(s, m.metallic.texture);
  EXPECT_EQ(metal.channel, ImageChannel::kBlue);
  EXPECT_EQ(metal.scale, 0.25f);
  EXPECT_EQ(metal.encoding, ColorEncoding::kLinear);
  EXPECT_EQ(image(s, m.roughness.texture).channel, ImageChannel::kGreen);
  EXPECT_EQ(s.files.size(), 2u) << "the image is bundled once";
}

TEST_F(GltfMaterialTest, SamplersAndTransforms) {
  document_["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}}};
  document_["textures"][0]["sampler"] = 0;
  material()["normalTexture"] = json::parse(R"({"index": 0, "scale": 2, "extensions": {
      "KHR_texture_transform": {"offset": [0.1, 0.2], "rotation": 0.3, "scale": [4, 5]}}})");
  const SceneDescription s = clean_document();
  const MaterialDescription& m = s.materials.at(0);
  EXPECT_EQ(m.normal_scale, 2);
  EXPECT_TRUE(m.normal_follows_v);
  const ImageTexture& t = image(s, m.normal_map);
  EXPECT_EQ(t.wrap, Wrap::kClamp);
  EXPECT_EQ(t.wrap_t, Wrap::kMirror);
  EXPECT_EQ(t.filter, TexelFilter::kNearest);
  // glTF's (u, v) = (0.7, 0.4), v downwards, by the extension's matrices.
  const double c = std::cos(0.3), n = std::sin(0.3), u = 0.7, v = 0.4;
  const double want_s = c * 4 * u + n * 5 * v + 0.1, want_t = -n * 4 * u + c * 5 * v + 0.2;
  const UvMapping& w = t.mapping;
  EXPECT_NEAR(w.su * u + w.sv_u * (1 - v) + w.du, want_s, 1e-6);
  EXPECT_NEAR(w.sv * (1 - v) + w.su_v * u + w.dv, 1 - want_t, 1e-6);
}

TEST_F(GltfMaterialTest, AlphaModes) {
  auto& m = material();
  m["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 0.3};
  EXPECT_EQ(clean_document().shapes[0].alpha.value, 1) << "opaque";
  m["alphaMode"] = "BLEND";
  EXPECT_EQ(clean_document().shapes[0].alpha.value, 0.3f);
  m["alphaMode"] = "MASK";
  EXPECT_TRUE(load_document().scene.shapes.empty()) << "below the cutoff of 0.5";
  m["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
  m["alphaCutoff"] = 0.25;
  const SceneDescription s = clean_document();
  const auto& step =
      std::get<StepTexture>(s.textures.at(static_cast<size_t>(s.shapes[0].alpha.texture)).kind);
  EXPECT_EQ(step.edge, 0.25f);
  EXPECT_EQ(image(s, step.value.texture).channel, ImageChannel::kAlpha);
  EXPECT_EQ(image(s, step.value.texture).scale, 0.3f);
  m["alphaMode"] = "GLASS";
  EXPECT_TRUE(mentions(load_document(), "/materials/0/alphaMode: is neither OPAQUE, MASK nor BLEND"));
}

TEST_F(GltfMaterialTest, Emission) {
  material()["emissiveFactor"] = {0.5, 0.25, 0};
  material()["doubleSided"] = true;
  material()["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 8;
  material()["emissiveTexture"]["index"] = 0;
  const SceneDescription s = clean_document();
  EXPECT_EQ(s.area_lights.at(0).radiance, (Rgb{4, 2, 0}));
  EXPECT_EQ(image(s, s.area_lights[0].texture).encoding, ColorEncoding::kSrgb);
  EXPECT_TRUE(s.area_lights[0].two_sided);
}

TEST_F(GltfMaterialTest, UnlitSurfacesShineWithTheirColour) {
  material()["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, 0.25, 0.75, 1};
  material()["extensions"]["KHR_materials_unlit"] = json::object();
  const SceneDescription s = clean_document();
  EXPECT_EQ(only<DiffuseMaterial>(s).reflectance.value, (Rgb{0, 0, 0}));
  ASSERT_EQ(s.area_lights.size(), 1u);
  EXPECT_EQ(s.area_lights[0].radiance, (Rgb{0.5f, 0.25f, 0.75f}));
  EXPECT_TRUE(s.area_lights[0].two_sided);
}

TEST_F(GltfMaterialTest, TransmissionIsASheetOrASolid) {
  auto& m = material();
  m["pbrMetallicRoughness"] = {{"metallicFactor", 0}, {"roughnessFactor", 0}};
  m["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 1;
  m["extensions"]["KHR_materials_ior"]["ior"] = 1.4;
  EXPECT_TRUE(only<TransmissionMaterial>(clean_document()).thin);
  m["extensions"]["KHR_materials_volume"]["thicknessFactor"] = 0.1;
  const auto solid = only<TransmissionMaterial>(clean_document());
  EXPECT_FALSE(solid.thin);
  EXPECT_EQ(solid.ior, 1.4f);
  m["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 0.25;
  m["pbrMetallicRoughness"]["metallicFactor"] = 0.5;
  EXPECT_EQ(only<MixMaterial>(clean_document()).amount.value, 0.125f);
  m["extensions"]["KHR_materials_volume"]["attenuationDistance"] = 1;
}

// What is left of a beam after the distance is the colour.
TEST_F(GltfMaterialTest, AVolumeAbsorbsInside) {
  auto& m = material();
  m["pbrMetallicRoughness"] = {{"metallicFactor", 0}, {"roughnessFactor", 0}};
  m["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 1;
  auto& volume = m["extensions"]["KHR_materials_volume"];
  volume = {{"thicknessFactor", 0.1}, {"attenuationColor", {0.25, 0.5, 1}}};
  EXPECT_TRUE(clean_document().media.empty());  // the distance is infinite
  volume["attenuationDistance"] = 2;
  const SceneDescription s = clean_document();
  ASSERT_EQ(s.media.size(), 1u);
  EXPECT_FLOAT_EQ(s.media[0].sigma_a.r, static_cast<float>(std::log(4.0) / 2));
  EXPECT_FLOAT_EQ(s.media[0].sigma_a.g, static_cast<float>(std::log(2.0) / 2));
  EXPECT_EQ(s.media[0].sigma_a.b, 0);
  EXPECT_EQ(s.media[0].sigma_s, (Rgb{0, 0, 0}));
  EXPECT_EQ(s.shapes[0].media, (MediumInterface{0, -1}));
  volume["thicknessFactor"] = 0;
  EXPECT_TRUE(clean_document().media.empty());  // a sheet has no inside
  volume["thicknessFactor"] = 1;
  volume["attenuationDistance"] = 0;
  EXPECT_TRUE(mentions(load_document(), "is not above 0; nothing is absorbed"));
}

TEST_F(GltfMaterialTest, CoatAndSpecular) {
  material()["extensions"] = json::parse(R"({
    "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.1},
    "KHR_materials_specular": {"specularFactor": 0.25, "specularColorFactor": [1, 0.5, 2]}})");
  const auto m = only<MetallicRoughnessMaterial>(clean_document());
  EXPECT_EQ(m.clearcoat.value, 0.5f);
  EXPECT_EQ(m.clearcoat_roughness.value, 0.1f);
  EXPECT_EQ(m.specular.value, 0.25f);
  EXPECT_EQ(m.specular_color.value, (Rgb{1, 0.5f, 2}));
}

TEST_F(GltfMaterialTest, Sheen) {
  material()["extensions"] = json::parse(R"({
    "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.25, 1], "sheenRoughnessFactor": 0.4}})");
  const auto m = only<MetallicRoughnessMaterial>(clean_document());
  EXPECT_EQ(m.sheen_color.value, (Rgb{0.5f, 0.25f, 1}));
  EXPECT_EQ(m.sheen_roughness.value, 0.4f);
  auto& sheen = material()["extensions"]["KHR_materials_sheen"];
  sheen["sheenRoughnessTexture"]["index"] = 0;
  sheen["sheenColorTexture"]["index"] = 0;
  sheen["sheenColorFactor"] = {1, 1, 1};
  sheen["sheenRoughnessFactor"] = 1;
  const SceneDescription s = clean_document();
  const auto textured = only<MetallicRoughnessMaterial>(s);
  EXPECT_EQ(image(s, textured.sheen_roughness.texture).channel, ImageChannel::kAlpha);
  EXPECT_EQ(image(s, textured.sheen_color.texture).encoding, ColorEncoding::kSrgb);
  sheen["sheenRoughnessFactor"] = 2;
  EXPECT_TRUE(mentions(load_document(), "it is clamped"));
}

TEST_F(GltfMaterialTest, Iridescence) {
  material()["extensions"]["KHR_materials_iridescence"] = json::object();
  EXPECT_EQ(only<MetallicRoughnessMaterial>(clean_document()).iridescence.value, 0);
  auto& film = material()["extensions"]["KHR_materials_iridescence"];
  film = json::parse(R"({"iridescenceFactor": 0.5, "iridescenceIor": 1.8, "iridescenceThicknessMinimum": 200,
                         "iridescenceThicknessMaximum": 550})");
  const auto m = only<MetallicRoughnessMaterial>(clean_document());
  EXPECT_EQ(m.iridescence.value, 0.5f);
  EXPECT_EQ(m.iridescence_ior, 1.8f);
  EXPECT_EQ(m.iridescence_nm, (std::array{200.0f, 550.0f}));
  EXPECT_EQ(m.iridescence_thickness.value, 1);
  film["iridescenceTexture"]["index"] = 0;
  film["iridescenceThicknessTexture"]["index"] = 0;
  const SceneDescription s = clean_document();
  const auto textured = only<MetallicRoughnessMaterial>(s);
  EXPECT_EQ(image(s, textured.iridescence.texture).channel, ImageChannel::kRed);
  EXPECT_EQ(image(s, textured.iridescence_thickness.texture).channel, ImageChannel::kGreen);
  film["iridescenceIor"] = 0.5;
  EXPECT_TRUE(mentions(load_document(), "it is clamped"));
}

TEST_F(GltfMaterialTest, Anisotropy) {
  auto& brushed = material()["extensions"]["KHR_materials_anisotropy"];
  brushed = {
      {"anisotropyStrength", 0.5}, {"anisotropyRotation", -M_PI / 2}, {"anisotropyTexture", {{"index", 0}}}};
  const SceneDescription s = clean_document();
  const auto m = only<MetallicRoughnessMaterial>(s);
  EXPECT_EQ(m.anisotropy, 0.5f);
  EXPECT_FLOAT_EQ(m.anisotropy_rotation, 0.75f);
  EXPECT_EQ(image(s, m.anisotropy_texture).encoding, ColorEncoding::kLinear);
  material()["extensions"]["KHR_materials_iridescence"]["iridescenceFactor"] = 1;
  EXPECT_TRUE(mentions(load_document(), "a material with sheen or iridescence has no anisotropy"));
  brushed["anisotropyStrength"] = 2;
  EXPECT_TRUE(mentions(load_document(), "it is clamped"));
}

TEST_F(GltfMaterialTest, DiffuseTransmission) {
  auto& through = material()["extensions"]["KHR_materials_diffuse_transmission"];
  through = {{"diffuseTransmissionFactor", 0.5}, {"diffuseTransmissionColorFactor", {1, 0.5, 0.25}}};
  const auto m = only<MetallicRoughnessMaterial>(clean_document());
  EXPECT_EQ(m.translucence.value, 0.5f);
  EXPECT_EQ(m.translucent_color.value, (Rgb{1, 0.5f, 0.25f}));
  through["diffuseTransmissionTexture"]["index"] = 0;
  through["diffuseTransmissionColorFactor"] = {1, 1, 1};
  through["diffuseTransmissionColorTexture"]["index"] = 0;
  const SceneDescription s = clean_document();
  const auto textured = only<MetallicRoughnessMaterial>(s);
  EXPECT_EQ(image(s, textured.translucence.texture).channel, ImageChannel::kAlpha);
  EXPECT_EQ(image(s, textured.translucent_color.texture).encoding, ColorEncoding::kSrgb);
  material()["extensions"]["KHR_materials_volume"] = {
      {"thicknessFactor", 1}, {"attenuationDistance", 2}, {"attenuationColor", {0.5, 0.5, 0.5}}};
  EXPECT_EQ(clean_document().media.size(), 1u);
  through["diffuseTransmissionFactor"] = -1;
  EXPECT_TRUE(mentions(load_document(), "it is clamped"));
}

TEST_F(GltfMaterialTest, SpecularGlossiness) {
  material()["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {
      {"diffuseFactor", {0.2, 0.3, 0.4, 1}}, {"specularFactor", {0.1, 0.1, 0.1}}, {"glossinessFactor", 0.75}};
  const auto m = only<MetallicRoughnessMaterial>(clean_document());
  EXPECT_EQ(m.base_color.value, (Rgb{0.2f, 0.3f, 0.4f}));
  EXPECT_EQ(m.ior, 0);
  EXPECT_EQ(m.specular_color.value, (Rgb{0.1f, 0.1f, 0.1f}));
  EXPECT_EQ(m.metallic.value, 0);
  EXPECT_EQ(m.roughness.value, 0.25f);
}

TEST_F(GltfMaterialTest, WhatIsLeftOutIsNamed) {
  material()["extensions"]["KHR_materials_dispersion"] = json::object();
  EXPECT_TRUE(mentions(load_document(), "KHR_materials_dispersion is ignored"));
  EXPECT_FALSE(load_document({true, "", ""}).ok());
}

TEST_F(GltfMaterialTest, ASecondSetOfCoordinates) {
  primitive()["attributes"]["TEXCOORD_1"] = 2;
  primitive()["attributes"].erase("TEXCOORD_0");
  material()["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}, {"texCoord", 1}};
  EXPECT_EQ(mesh_of(clean_document()).uvs.size(), 4u);
  EXPECT_TRUE(mesh_of(clean_document()).second_uvs.empty());
  // The normal map's is the first, whose tangents it follows.
  primitive()["attributes"]["TEXCOORD_0"] =
      add_accessor(raw_bytes<float>({5, 1, 6, 1, 7, 1, 8, 1}), 5126, 4, "VEC2");
  material()["normalTexture"] = {{"index", 0}};
  const SceneDescription s = clean_document();
  EXPECT_EQ(mesh_of(s).uvs[0].x, 5);
  EXPECT_EQ(mesh_of(s).second_uvs[1].x, 1);
  EXPECT_TRUE(image(s, only<MetallicRoughnessMaterial>(s).base_color.texture).second_uvs);
  EXPECT_FALSE(image(s, s.materials[0].normal_map).second_uvs);
  // More than two, and one that the mesh does not have.
  material()["emissiveFactor"] = {1, 1, 1};
  material()["emissiveTexture"] = {{"index", 0}, {"texCoord", 2}};
  EXPECT_TRUE(mentions(load_document(), "a third set of texture coordinates"));
  material().erase("emissiveTexture");
  primitive()["attributes"].erase("TEXCOORD_0");
  EXPECT_TRUE(mentions(load_document(), "has no TEXCOORD_0, by which its material has textures"));
}

TEST_F(GltfMaterialTest, EmbeddedImages) {
  document_["images"][0] = {{"uri", "data:image/png;base64," + base64("\x89PNG\r\n")}};
  material()["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
  const SceneDescription s = clean_document();
  const ImageTexture& t = image(s, only<MetallicRoughnessMaterial>(s).base_color.texture);
  ASSERT_NE(t.contents, nullptr);
  EXPECT_TRUE(t.contents->starts_with("\x89PNG"));
  EXPECT_TRUE(t.path.ends_with(".png"));
  EXPECT_EQ(s.files.size(), 1u);
  document_["images"][0] = {{"bufferView", 0}, {"mimeType", "image/png"}};
  EXPECT_TRUE(has_error(load_document(), "/images/0: is no PNG, JPEG or WebP"));
}

}  // namespace
}  // namespace lightmill
