// Broken glTF files: one line that names the place, and nothing worse.
#include <limits>

#include "tests/common/scene/gltf/gltf_fixture.h"

namespace lightmill {
namespace {

using nlohmann::json;

class BadGltf : public GltfTest {};

TEST_F(BadGltf, Json) {
  EXPECT_TRUE(
      has_error(load_text("{\n  \"asset\": {\"version\" \"2.0\"}}"), "scene.gltf:2:27: the JSON is damaged"));
  EXPECT_TRUE(has_error(load_text(""), "the JSON is damaged"));
  EXPECT_TRUE(has_error(load_text("[]"), "must be a JSON object"));
  EXPECT_TRUE(has_error(load_text(std::string(100'000, '[')), "nested deeper than 64"));
  EXPECT_TRUE(has_error(load_text("{}"), "needs \"asset\""));
  EXPECT_TRUE(has_error(load_text("{\"asset\": {\"version\": \"1.0\"}}"), "glTF version \"1.0\""));
  EXPECT_TRUE(has_error(load_text("{\"asset\": {\"version\": 1e999}}"), "out of range"));
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
  EXPECT_TRUE(has_error(with("count", 0), "/accessors/0/count"));
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
  EXPECT_TRUE(has_error(load_document(), "larger than their view's"));
}

TEST_F(BadGltf, Meshes) {
  primitive()["indices"] = add_accessor(raw_bytes<uint16_t>({0, 1, 4}), 5123, 3, "SCALAR");
  EXPECT_TRUE(has_error(load_document(), "/primitives/0/indices: index 2 is 4, but there are 4 vertices"));
  primitive()["indices"] = add_accessor(raw_bytes<uint16_t>({0, 1}), 5123, 2, "SCALAR");
  EXPECT_TRUE(has_error(load_document(), "has 2 corners"));
  primitive()["indices"] = 3;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  primitive()["attributes"]["POSITION"] =
      add_accessor(raw_bytes<float>({0, 0, 0, nan, 0, 0, 1, 1, 0, 0, 1, 0}), 5126, 4, "VEC3");
  EXPECT_TRUE(has_error(load_document(), "/meshes/0/primitives/0: vertex 1 is not finite"));
  primitive()["attributes"]["POSITION"] = add_accessor(raw_bytes<float>({0, 0, 0}), 5126, 1, "VEC3");
  EXPECT_TRUE(has_error(load_document(), "have different counts"));
  primitive()["mode"] = 7;
  EXPECT_TRUE(has_error(load_document(), "/mode"));
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
  EXPECT_TRUE(has_error(load_document(), "is no rotation"));
  document_["nodes"][0] = {{"mesh", 0}, {"translation", {1e39, 0, 0}}};
  EXPECT_TRUE(has_error(load_document(), "/nodes/0/translation/0: must be a number"));
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
  EXPECT_TRUE(has_error(load_document(), "/cameras/0/perspective/yfov"));
  document_["cameras"][0]["type"] = "fisheye";
  EXPECT_TRUE(has_error(load_document(), "must be \"perspective\" or \"orthographic\""));
  document_["cameras"][0] = {{"type", "orthographic"}, {"orthographic", {{"xmag", 0}, {"ymag", 1}}}};
  EXPECT_TRUE(has_error(load_document(), "must not be 0"));
  document_["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
  EXPECT_TRUE(has_error(load_document(), "refers to light 0, but there are 0"));
}

TEST_F(BadGltf, Extensions) {
  document_["extensionsRequired"] = {"KHR_texture_basisu"};
  EXPECT_TRUE(has_error(load_document(), "/extensionsRequired/0: the file can't be read without"));
  document_.erase("extensionsRequired");
  document_["animations"] = json::array({json::object()});
  document_["nodes"][0]["skin"] = 0;
  const LoadResult r = load_document();
  EXPECT_TRUE(r.ok());
  EXPECT_TRUE(mentions(r, "animations"));
  EXPECT_TRUE(mentions(r, "skins"));
}

}  // namespace
}  // namespace lightmill
