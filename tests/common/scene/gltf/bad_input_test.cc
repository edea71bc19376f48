// Broken glTF files: one line that names the place, and nothing worse.
#include <limits>

#include "tests/common/scene/gltf/gltf_fixture.h"

namespace lightmill {
namespace {

using nlohmann::json;

class BadGltf : public GltfTest {
 protected:
  /// It loads, and a warning says so.
  static bool mended(const LoadResult& r, const std::string& what) { return r.ok() && mentions(r, what); }
};

TEST_F(BadGltf, Json) {
  EXPECT_TRUE(
      has_error(load_text("{\n  \"asset\": {\"version\" \"2.0\"}}"), "scene.gltf:2:27: the JSON is damaged"));
  EXPECT_TRUE(has_error(load_text(""), "the JSON is damaged"));
  EXPECT_TRUE(has_error(load_text("[]"), "must be a JSON object"));
  EXPECT_TRUE(has_error(load_text(std::string(100'000, '[')), "nested deeper than 64"));
  EXPECT_TRUE(has_error(load_text("{}"), "the file shows nothing"));
  EXPECT_TRUE(has_error(load_text("{\"asset\": {\"version\": \"1.0\"}}"),
                        "this is glTF 1.0; convert it: gltf-pipeline"));
  EXPECT_TRUE(has_error(load_text("{\"meshes\": {}}"), "this is glTF 1.0"));
  EXPECT_TRUE(has_error(load_text("{\"asset\": {\"version\": \"3.0\"}}"), "2.0 is needed"));
  EXPECT_TRUE(mentions(load_text("{\"asset\": {\"version\": 1e999}}"), "the JSON holds \"1e999\""));
  EXPECT_FALSE(load_text("{\"asset\": {\"version\": 1e999}}").ok());
}

TEST_F(BadGltf, NumbersThatJsonHasNot) {
  document_["nodes"][0]["translation"] = {0, 0, 7};
  document_["accessors"][0]["max"] = {8, 8, 9};
  std::string text = document_.dump(1);
  const auto put = [&](const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    text.replace(at, from.size(), to);
  };
  put("8,\n", "NaN,\n");
  put("8,\n", "-Infinity,\n");
  put("9\n", "1e999\n");
  put("7\n", "-nan\n");
  const LoadResult r = load_text(text);
  EXPECT_TRUE(r.ok()) << listed(r);
  EXPECT_TRUE(mentions(r, "the JSON holds \"NaN\", which is no finite number; 0 is taken")) << listed(r);
  EXPECT_TRUE(mentions(r, "the JSON holds \"-Infinity\", which is no finite number; -3.4e38 is taken"));
  EXPECT_EQ(r.scene.shapes.at(0).object_to_world.m[2][3], 0);
  EXPECT_FALSE(
      load_text("{\"asset\": {\"version\": \"2.0\"}, \"nodes\": [{\"translation\": [NaN, 0, }]}").ok());
}

TEST_F(BadGltf, PlacesAreLinesOfTheFile) {
  document_["meshes"][0]["primitives"][0]["indices"] = 9;
  const std::string text = document_.dump(1);
  const auto line =
      std::count(text.begin(), text.begin() + static_cast<long>(text.find("\"indices\"")), '\n') + 1;
  EXPECT_TRUE(has_error(load_text(text), "scene.gltf:" + std::to_string(line) +
                                             ":6: /meshes/0/primitives/0/indices: refers to accessor 9"));
}

TEST_F(BadGltf, Containers) {
  const auto load_glb = [&](const std::string& bytes) {
    folder_.write("scene.glb", bytes);
    return load_scene("scene.glb", DirectoryFiles(folder_.path()));
  };
  document_["buffers"][0].erase("uri");
  const std::string whole = glb(document_, square_);
  ASSERT_TRUE(load_glb(whole).ok());
  for (size_t size = 4; size < whole.size(); size += 7)
    EXPECT_FALSE(load_glb(whole.substr(0, size)).ok()) << size;
  EXPECT_TRUE(has_error(load_glb(whole.substr(0, 100)), "the .glb file is cut off"));
  EXPECT_TRUE(has_error(load_glb(glb(document_, "")), "/buffers/0: has no \"uri\""));
  EXPECT_TRUE(has_error(load_glb(glb(document_, square_.substr(0, 100))), "should hold 140 bytes"));
  // Its length as the header says it, and its padding, are wrong in many files.
  std::string other_length = whole + std::string(3, '\0');
  other_length[8] = 1, other_length[9] = 0;
  EXPECT_TRUE(load_glb(other_length).ok());
  document_["buffers"][0]["byteLength"] = 143;
  EXPECT_TRUE(mended(load_glb(glb(document_, square_)), "its padding is missing"));
  std::string version_1 = whole;
  version_1[4] = 1;
  EXPECT_TRUE(has_error(load_glb(version_1), "of version 1"));
}

TEST_F(BadGltf, Buffers) {
  auto& buffer = document_["buffers"][0];
  buffer["uri"] = "none.bin";
  EXPECT_TRUE(has_error(load_document(), "/buffers/0/uri: there is no file \"none.bin\""));
  buffer["uri"] = "https://example.org/a.bin";
  EXPECT_TRUE(has_error(load_document(), "is no file beside the scene"));
  buffer["uri"] = "data:;base64,AB!D";
  EXPECT_TRUE(has_error(load_document(), "not base64"));
  buffer["uri"] = data_uri(square_.substr(0, 50));
  EXPECT_TRUE(has_error(load_document(), "/buffers/0: should hold 140 bytes, but there are only 50"));
  buffer["byteLength"] = 1e15;
  EXPECT_TRUE(has_error(load_document(), "/buffers/0/byteLength: must be a number from 1"));
}

TEST_F(BadGltf, Accessors) {
  const json good = document_["accessors"][0];
  const auto with = [&](const char* key, const json& value) {
    document_["accessors"][0] = good;
    document_["accessors"][0][key] = value;
    return load_document();
  };
  EXPECT_TRUE(has_error(with("count", 1'000'000'000), "/accessors/0: its 1000000000 elements reach beyond"));
  EXPECT_TRUE(mentions(with("count", 0), "has no POSITION, so there is nothing to see"));
  EXPECT_TRUE(has_error(with("count", 2.5), "must be a whole number"));
  EXPECT_TRUE(has_error(with("byteOffset", 1'000'000), "reach beyond"));
  EXPECT_TRUE(has_error(with("byteOffset", -1), "must be a number from 0"));
  EXPECT_TRUE(has_error(with("componentType", 5124), "is none that glTF has"));
  EXPECT_TRUE(has_error(with("type", "VEC5"), "must be SCALAR"));
  EXPECT_TRUE(has_error(with("type", "SCALAR"), "does not fit what it is used for"));
  EXPECT_TRUE(has_error(with("bufferView", 9), "refers to buffer view 9, but there are 2"));
  document_["accessors"][0] = {{"componentType", 5126}, {"type", "VEC3"}, {"count", 1'000'000'000}};
  EXPECT_TRUE(has_error(load_document(), "but no \"bufferView\""));
}

TEST_F(BadGltf, Views) {
  document_["bufferViews"][0]["byteLength"] = 1000;
  EXPECT_TRUE(has_error(load_document(), "/bufferViews/0: reaches to byte 1000 of buffer 0"));
  document_["bufferViews"][0]["byteLength"] = 128;
  document_["bufferViews"][0]["byteStride"] = 4;
  EXPECT_TRUE(mended(load_document(), "larger than their view's"));
}

TEST_F(BadGltf, Meshes) {
  primitive()["indices"] = add_accessor(raw_bytes<uint16_t>({0, 1, 4}), 5123, 3, "SCALAR");
  EXPECT_TRUE(
      has_error(load_document(), "/primitives/0/indices: 1 triangles refer to vertices beyond the 4"));
  primitive()["indices"] = add_accessor(raw_bytes<uint16_t>({0, 1, 4, 0, 1, 2, 0}), 5123, 7, "SCALAR");
  LoadResult r = load_document();
  EXPECT_TRUE(mended(r, "refer to vertices beyond the 4 that there are; they are left out"));
  EXPECT_TRUE(mended(r, "has 7 corners"));
  EXPECT_EQ(mesh_of(r.scene).triangles.size(), 1u);
  primitive()["indices"] = 3;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  primitive()["attributes"]["POSITION"] =
      add_accessor(raw_bytes<float>({0, 0, 0, nan, 0, 0, 1, 1, 0, 0, 1, 0}), 5126, 4, "VEC3");
  r = load_document();
  EXPECT_TRUE(mended(r, "/meshes/0/primitives/0: 1 triangles with a vertex that is not finite"));
  EXPECT_EQ(mesh_of(r.scene).triangles.size(), 1u);
  primitive()["attributes"]["POSITION"] = add_accessor(raw_bytes<float>({0, 0, 0}), 5126, 1, "VEC3");
  EXPECT_TRUE(has_error(load_document(), "refer to vertices beyond the 1"));
}

TEST_F(BadGltf, WhatAPictureCanDoWithoutIsLeftOut) {
  const json good = primitive()["attributes"];
  for (const char* name : {"NORMAL", "TEXCOORD_0", "COLOR_0"}) {
    for (const int accessor : {99, add_accessor(raw_bytes<float>({0, 0, 0}), 5126, 1, "VEC3"), 3}) {
      primitive()["attributes"] = good;
      primitive()["attributes"][name] = accessor;
      const LoadResult r = load_document();
      EXPECT_TRUE(mended(r, "left out")) << name << accessor;
      EXPECT_EQ(mesh_of(r.scene).triangles.size(), 2u);
    }
  }
  primitive()["attributes"] = good;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  primitive()["attributes"]["TEXCOORD_0"] =
      add_accessor(raw_bytes<float>({0, 0, nan, 0, 0, 1, 1, 1}), 5126, 4, "VEC2");
  EXPECT_TRUE(mended(load_document(), "1 texture coordinates that are not finite count as 0"));
  primitive()["attributes"]["NORMAL"] =
      add_accessor(raw_bytes<float>({nan, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 1}), 5126, 4, "VEC3");
  EXPECT_TRUE(mended(load_document(), "1 normals without direction"));
}

TEST_F(BadGltf, EmptyThingsDrawNothing) {
  document_["nodes"].push_back({{"mesh", 1}});
  document_["scenes"][0]["nodes"].push_back(2);
  const json empty =
      json::array({{{"primitives", json::array()}},
                   {{"name", "nothing"}},
                   {{"primitives", {{{"attributes", json::object()}}}}},
                   {{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 3}, {"mode", 4}}}}}});
  document_["accessors"].push_back({{"componentType", 5123}, {"count", 0}, {"type", "SCALAR"}});
  for (json mesh : empty) {
    if (mesh.contains("primitives") && mesh["primitives"].size() == 1 &&
        mesh["primitives"][0].contains("indices"))
      mesh["primitives"][0]["indices"] = document_["accessors"].size() - 1;
    document_["meshes"][1] = mesh;
    const LoadResult r = load_document();
    EXPECT_TRUE(mended(r, "nothing to see")) << mesh;
    EXPECT_EQ(r.scene.shapes.size(), 1u);
  }
}

TEST_F(BadGltf, NumbersOutOfRangeAreClampedAndEachKindIsSaidOnce) {
  auto& materials = document_["materials"];
  for (int i = 0; i < 42; ++i) {
    materials.push_back({{"pbrMetallicRoughness", {{"baseColorFactor", {1.0000001, 0.5, -1e-9, 2}}}}});
    document_["meshes"][0]["primitives"].push_back(primitive());
    document_["meshes"][0]["primitives"].back()["material"] = i + 1;
  }
  const LoadResult r = load_document();
  EXPECT_TRUE(
      mended(r, "/baseColorFactor/0: 1.0000001 is not from 0 to 1; it is clamped, and 125 more like it"));
  EXPECT_EQ(r.problems.size(), 1u);
  EXPECT_TRUE(has_error(load_document({.strict = true}), "it is clamped, and 125 more"));
}

TEST_F(BadGltf, EveryFactorIsClamped) {
  // Each on its own: what is wrong, and that it loads.
  const std::vector<std::pair<const char*, json>> materials = {
      {"roughnessFactor", {{"pbrMetallicRoughness", {{"roughnessFactor", -0.5}}}}},
      {"metallicFactor", {{"pbrMetallicRoughness", {{"metallicFactor", 1.5}}}}},
      {"metallicFactor", {{"pbrMetallicRoughness", {{"metallicFactor", "1"}}}}},
      {"pbrMetallicRoughness", {{"pbrMetallicRoughness", json::array()}}},
      {"baseColorFactor", {{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1}}}}}},
      {"emissiveFactor", {{"emissiveFactor", {-1, 1, 1}}}},
      {"emissiveStrength",
       {{"emissiveFactor", {1, 1, 1}},
        {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 1e300}}}}}}},
      {"alphaMode", {{"alphaMode", "OPAK"}}},
      {"alphaCutoff", {{"alphaMode", "MASK"}, {"alphaCutoff", -1}}},
      {"doubleSided", {{"doubleSided", 1}, {"emissiveFactor", {1, 1, 1}}}},
      {"extensions", {{"extensions", 7}}},
      {"ior", {{"extensions", {{"KHR_materials_ior", {{"ior", 0.9}}}}}}},
      {"ior", {{"extensions", {{"KHR_materials_ior", {{"ior", -1}}}}}}},
      {"transmissionFactor", {{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 2}}}}}}},
      {"attenuationDistance",
       {{"pbrMetallicRoughness", {{"metallicFactor", 0}}},
        {"extensions",
         {{"KHR_materials_transmission", {{"transmissionFactor", 1}}},
          {"KHR_materials_volume", {{"thicknessFactor", 1}, {"attenuationDistance", 0}}}}}}},
      {"clearcoatFactor", {{"extensions", {{"KHR_materials_clearcoat", {{"clearcoatFactor", 3}}}}}}},
      {"sheenColorFactor", {{"extensions", {{"KHR_materials_sheen", {{"sheenColorFactor", {2, 0, 0}}}}}}}},
      {"iridescenceIor",
       {{"extensions", {{"KHR_materials_iridescence", {{"iridescenceFactor", 1}, {"iridescenceIor", 0}}}}}}},
      {"specularFactor", {{"extensions", {{"KHR_materials_specular", {{"specularFactor", 1.01}}}}}}},
      {"normalTexture", {{"normalTexture", "bumps"}}},
  };
  for (const auto& [key, material] : materials) {
    document_["materials"][0] = material;
    EXPECT_TRUE(mended(load_document(), key)) << material;
  }
}

TEST_F(BadGltf, SharedArraysAreBounded) {
  // A kilobyte of vertices, used by thousands of primitives: what is read stays in proportion to the file.
  for (int i = 0; i < 2000; ++i) document_["meshes"][0]["primitives"].push_back(primitive());
  EXPECT_TRUE(load_document().ok());
  std::vector<uint8_t> zeros(1 << 20, 0);
  for (size_t i = 0; i < zeros.size(); ++i) zeros[i] = static_cast<uint8_t>(i % 3);
  zeros.resize(zeros.size() / 3 * 3);
  const auto count = static_cast<int>(zeros.size());
  const int big = add_accessor(raw_bytes(zeros), 5121, count, "SCALAR");
  for (auto& p : document_["meshes"][0]["primitives"]) p["indices"] = big;
  EXPECT_TRUE(has_error(load_document(), "uses its buffers so often"));
}

TEST_F(BadGltf, Nodes) {
  document_["nodes"][0]["children"] = {0};
  EXPECT_TRUE(has_error(load_document(), "/nodes/0: is reached twice"));
  document_["nodes"][0]["children"] = {5};
  EXPECT_TRUE(has_error(load_document(), "/nodes/0/children/0: refers to node 5"));
  document_["nodes"][0] = {{"mesh", 0}, {"rotation", {0, 0, 0, 0}}};
  EXPECT_TRUE(mended(load_document(), "is no rotation: all four are 0; it does not turn"));
  document_["nodes"][0] = {{"mesh", 0}, {"rotation", {0, 0, 0, 3}}};
  EXPECT_TRUE(mended(load_document(), "of a length that is not 1"));
  document_["nodes"][0] = {{"mesh", 0}, {"translation", {1e39, 0, 0}}};
  EXPECT_TRUE(mended(load_document(), "/nodes/0/translation/0: 1e+39 is not from -1e+38 to 1e+38"));
  document_["nodes"][0] = {{"mesh", 0}, {"scale", {1, 0, 1}}};
  EXPECT_TRUE(mentions(load_document(), "flattened to nothing"));
}

TEST_F(BadGltf, DeepHierarchies) {
  constexpr int kDeep = 200'000;
  auto& nodes = document_["nodes"];
  for (int i = 2; i < kDeep; ++i) nodes.push_back({{"children", {i + 1}}});
  nodes.push_back({{"mesh", 0}});
  document_["scenes"][0]["nodes"].push_back(2);
  EXPECT_EQ(clean_document().instances.size(), 2u);
}

TEST_F(BadGltf, CamerasAndLights) {
  document_["cameras"][0]["perspective"]["yfov"] = 0;
  EXPECT_TRUE(mended(load_document(), "the camera gets 45 degrees"));
  document_["cameras"][0]["perspective"] = {{"yfov", 0.8}, {"aspectRatio", 0}};
  EXPECT_TRUE(mended(load_document(), "the picture is 16 to 9"));
  document_["cameras"][0]["type"] = "fisheye";
  EXPECT_TRUE(has_error(load_document(), "must be \"perspective\" or \"orthographic\""));
  document_["cameras"][0] = {{"type", "orthographic"}, {"orthographic", {{"xmag", 0}, {"ymag", 1}}}};
  EXPECT_TRUE(mended(load_document(), "must not be 0"));
  document_["cameras"][0]["orthographic"] = {{"xmag", 1}, {"ymag", 1}};
  auto& light = document_["extensions"]["KHR_lights_punctual"]["lights"][0];
  document_["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
  for (const auto& [key, value] : std::vector<std::pair<const char*, json>>{
           {"intensity", {{"type", "point"}, {"intensity", -1}}},
           {"brighter", {{"type", "point"}, {"intensity", 1e30}, {"color", {1e30, 1, 1}}}},
           {"color", {{"type", "point"}, {"color", {-1, 1, 1}}}},
           {"outerConeAngle", {{"type", "spot"}, {"spot", {{"outerConeAngle", 3}}}}},
           {"innerConeAngle", {{"type", "spot"}, {"spot", {{"innerConeAngle", 1}}}}}}) {
    light = value;
    EXPECT_TRUE(mended(load_document(), key)) << value;
  }
  document_["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 1;
  EXPECT_TRUE(mended(load_document(), "refers to light 1, but there are 1; it is left out"));
  document_["nodes"][1]["camera"] = 9;
  EXPECT_TRUE(mended(load_document(), "refers to camera 9, but there are 1; it is left out"));
}

TEST_F(BadGltf, CamerasAreChosenByNumberAndRepeatedNamesAreToldApart) {
  for (const double z : {6, 7, 8}) {
    document_["scenes"][0]["nodes"].push_back(document_["nodes"].size());
    document_["nodes"].push_back({{"camera", 0}, {"translation", {0, 0, z}}});
    if (z < 8) document_["nodes"].back()["name"] = "front";
  }
  const auto z_of = [&](const std::string& camera) {
    const LoadResult r = load_document({.camera = camera});
    EXPECT_TRUE(r.ok()) << camera;
    return r.scene.camera.camera_to_world.m[2][3];
  };
  EXPECT_EQ(z_of("front"), 5);
  EXPECT_EQ(z_of("front.1"), 6);
  EXPECT_EQ(z_of("front.2"), 7);
  EXPECT_EQ(z_of("3"), 8);
  EXPECT_EQ(z_of("1"), 6);
  const std::string list = "\"front\", \"front.1\", \"front.2\", \"3\"";
  EXPECT_TRUE(mentions(load_document(), "--camera chooses of " + list));
  EXPECT_TRUE(has_error(load_document({.camera = "4"}), "there are " + list + ", or 0 to 3"));
}

TEST_F(BadGltf, Extensions) {
  document_["extensionsRequired"] = {"KHR_texture_basisu"};
  EXPECT_TRUE(has_error(load_document(), "/extensionsRequired/0: the file can't be read without"));
  document_["extensionsRequired"] = {"KHR_materials_future"};
  EXPECT_TRUE(mended(load_document(), "the extension \"KHR_materials_future\""));
  document_.erase("extensionsRequired");
  document_["animations"] = json::array({json::object()});
  document_["nodes"][0]["skin"] = 0;
  const LoadResult r = load_document();
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "refers to skin 0"));
}

TEST_F(BadGltf, ImagesThatAreNotThereAreErrorsUnlessAskedOtherwise) {
  document_["images"] = {{{"uri", "Maps/wood.png"}}};
  document_["textures"] = {{{"source", 0}}};
  document_["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 0;
  EXPECT_TRUE(has_error(load_document(), "there is no file \"Maps/wood.png\""));
  LoadOptions options;
  options.missing_textures = true;
  const LoadResult without = load_document(options);
  EXPECT_TRUE(without.ok()) << listed(without);
  EXPECT_TRUE(mentions(without, "goes by its factors alone")) << listed(without);
  folder_.write("maps/Wood.PNG", "");
  const LoadResult other_case = load_document();
  EXPECT_TRUE(other_case.ok()) << listed(other_case);
  EXPECT_TRUE(mentions(other_case, "the file \"maps/Wood.PNG\" is taken")) << listed(other_case);
}

}  // namespace
}  // namespace lightmill
