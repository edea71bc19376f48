#pragma once
// Small glTF documents, put together from a template.
#include <cstring>
#include <nlohmann/json.hpp>

#include "tests/common/scene/scene_fixture.h"

namespace lightmill {

inline std::string base64(const std::string& bytes) {
  constexpr const char* kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k) out += i + k > bytes.size() ? '=' : kAlphabet[word >> (18 - 6 * k) & 63];
  }
  return out;
}

template <class T>
std::string raw_bytes(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

inline std::string data_uri(const std::string& bytes) {
  return "data:application/octet-stream;base64," + base64(bytes);
}

/// A .glb of a document and the bytes of its first buffer.
inline std::string glb(const nlohmann::json& document, const std::string& binary) {
  const auto word = [](size_t x) {
    const auto n = static_cast<uint32_t>(x);
    return std::string(reinterpret_cast<const char*>(&n), 4);
  };
  std::string json = document.dump();
  while (json.size() % 4 != 0) json += ' ';
  std::string padded = binary;
  while (padded.size() % 4 != 0) padded += '\0';
  std::string chunks = word(json.size()) + "JSON" + json;
  if (!binary.empty()) chunks += word(padded.size()) + std::string("BIN\0", 4) + padded;
  return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
}

class GltfTest : public SceneTest {
 protected:
  GltfTest() {
    // Buffer 0: a unit square of 4 vertices, its normals, uvs and 6 indices of 16 bits.
    const std::vector<float> numbers = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0,  // positions
                                        0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1,  // normals
                                        0, 1, 1, 1, 1, 0, 0, 0};             // uvs, v downwards
    square_ = raw_bytes(numbers) + raw_bytes<uint16_t>({0, 1, 2, 0, 2, 3});
    document_ = nlohmann::json::parse(R"({
      "asset": {"version": "2.0"},
      "scenes": [{"nodes": [0, 1]}],
      "nodes": [{"mesh": 0}, {"camera": 0, "translation": [0, 0, 5], "name": "front"}],
      "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "aspectRatio": 2}}],
      "materials": [{"emissiveFactor": [1, 1, 1]}],
      "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2},
                                  "indices": 3, "material": 0}]}],
      "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                    {"bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC3"},
                    {"bufferView": 0, "byteOffset": 96, "componentType": 5126, "count": 4, "type": "VEC2"},
                    {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
      "bufferViews": [{"buffer": 0, "byteLength": 128}, {"buffer": 0, "byteOffset": 128, "byteLength": 12}]
    })");
    document_["buffers"] = {{{"byteLength", 140}, {"uri", data_uri(square_)}}};
  }

  LoadResult load_text(const std::string& text, const LoadOptions& options = {}) {
    folder_.write("scene.gltf", text);
    return load_scene("scene.gltf", DirectoryFiles(folder_.path()), options);
  }
  LoadResult load_document(const LoadOptions& options = {}) { return load_text(document_.dump(1), options); }
  /// Adds a buffer of its own with a view and an accessor; returns the accessor.
  int add_accessor(const std::string& bytes, int component_type, int count, const std::string& type) {
    document_["buffers"].push_back({{"byteLength", bytes.size()}, {"uri", data_uri(bytes)}});
    document_["bufferViews"].push_back(
        {{"buffer", document_["buffers"].size() - 1}, {"byteLength", bytes.size()}});
    document_["accessors"].push_back({{"bufferView", document_["bufferViews"].size() - 1},
                                      {"componentType", component_type},
                                      {"count", count},
                                      {"type", type}});
    return static_cast<int>(document_["accessors"].size()) - 1;
  }
  nlohmann::json& primitive() { return document_["meshes"][0]["primitives"][0]; }
  static const TriangleMesh& mesh_of(const SceneDescription& scene, size_t shape = 0) {
    return *std::get<MeshShape>(scene.shapes.at(shape).kind).mesh;
  }
  /// As loaded, with an expectation that nothing was reported.
  SceneDescription clean_document() { return clean(load_document()); }

  std::string square_;
  nlohmann::json document_;
};

}  // namespace lightmill
