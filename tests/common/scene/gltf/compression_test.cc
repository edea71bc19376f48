// glTF meshes packed by Draco and by meshoptimizer: what was packed comes back, and damage is told.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include <random>

#include "tests/common/scene/gltf/gltf_fixture.h"

namespace lightmill {
namespace {

using nlohmann::json;

class PackedGltf : public GltfTest {
 protected:
  const float* positions() const { return reinterpret_cast<const float*>(square_.data()); }

  /// Buffer view of bytes in a buffer of its own.
  int add_view(const std::string& bytes) {
    document_["buffers"].push_back({{"byteLength", bytes.size()}, {"uri", data_uri(bytes)}});
    document_["bufferViews"].push_back(
        {{"buffer", document_["buffers"].size() - 1}, {"byteLength", bytes.size()}});
    return static_cast<int>(document_["bufferViews"].size()) - 1;
  }
  /// The view as meshoptimizer's extension describes it; what is outside the extension is a stand-in without
  /// bytes.
  int add_packed_view(const std::string& packed, const char* mode, int count, int stride,
                      const char* filter = "NONE") {
    const int plain = add_view(packed);
    json& view = document_["bufferViews"][static_cast<size_t>(plain)];
    json extension = {{"buffer", view["buffer"]}, {"byteLength", packed.size()}, {"mode", mode},
                      {"count", count},           {"byteStride", stride},        {"filter", filter}};
    document_["buffers"].push_back({{"byteLength", count * stride}});
    view = {{"buffer", document_["buffers"].size() - 1},
            {"byteLength", count * stride},
            {"extensions", {{"EXT_meshopt_compression", extension}}}};
    return plain;
  }
  static std::string packed_vertices(const void* vertices, size_t count, size_t stride) {
    std::string out(meshopt_encodeVertexBufferBound(count, stride), '\0');
    out.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(out.data()), out.size(), vertices,
                                          count, stride));
    return out;
  }
  /// The square's positions, normals and indices packed by meshoptimizer.
  void pack_by_meshopt() {
    document_["extensionsRequired"] = {"EXT_meshopt_compression"};
    const int p = add_packed_view(packed_vertices(positions(), 4, 12), "ATTRIBUTES", 4, 12);
    document_["accessors"][0] = {{"bufferView", p}, {"componentType", 5126}, {"count", 4}, {"type", "VEC3"}};
    const unsigned int indices[] = {0, 1, 2, 0, 2, 3};
    std::string packed(meshopt_encodeIndexBufferBound(6, 4), '\0');
    packed.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(packed.data()), packed.size(),
                                            indices, 6));
    document_["accessors"][3]["bufferView"] = add_packed_view(packed, "TRIANGLES", 6, 2);
  }
  json& meshopt_extension() {
    const auto view = document_["accessors"][0]["bufferView"].get<size_t>();
    return document_["bufferViews"][view]["extensions"]["EXT_meshopt_compression"];
  }

  /// Bytes of the square as Draco packs it, its attributes of ids 0, 1, 2.
  std::string packed_square(int method) const {
    draco::TriangleSoupMeshBuilder builder;
    builder.Start(2);
    const int p = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
    const int n = builder.AddAttribute(draco::GeometryAttribute::NORMAL, 3, draco::DT_FLOAT32);
    const int t = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
    const uint32_t corners[2][3] = {{0, 1, 2}, {0, 2, 3}};
    for (uint32_t f = 0; f < 2; ++f) {
      const auto values = [&](int id, size_t first, size_t width) {
        const auto at = [&](size_t c) { return positions() + first + width * corners[f][c]; };
        builder.SetAttributeValuesForFace(id, draco::FaceIndex(f), at(0), at(1), at(2));
      };
      values(p, 0, 3);
      values(n, 12, 3);
      values(t, 24, 2);
    }
    const auto mesh = builder.Finalize();
    draco::Encoder encoder;
    encoder.SetEncodingMethod(method);
    draco::EncoderBuffer buffer;
    EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
    return {buffer.data(), buffer.size()};
  }
  void pack_by_draco(const std::string& packed) {
    document_["extensionsRequired"] = {"KHR_draco_mesh_compression"};
    for (size_t i = 0; i < 4; ++i) document_["accessors"][i].erase("bufferView");
    for (size_t i = 0; i < 3; ++i) document_["accessors"][i].erase("byteOffset");
    primitive()["extensions"]["KHR_draco_mesh_compression"] = {
        {"bufferView", add_view(packed)},
        {"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"TEXCOORD_0", 2}}}};
  }
  /// Each corner of the square has its uv, whatever the order of the vertices.
  static void expect_square(const TriangleMesh& mesh) {
    ASSERT_EQ(mesh.triangles.size(), 2u);
    double area = 0;
    for (const auto& t : mesh.triangles) {
      const Vec3f a = mesh.positions[t[0]], b = mesh.positions[t[1]], c = mesh.positions[t[2]];
      area += ((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)) / 2;
    }
    EXPECT_NEAR(area, 1, 1e-6) << "wound as it was";
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      EXPECT_NEAR(mesh.uvs[i].x, mesh.positions[i].x, 1e-6);
      EXPECT_NEAR(mesh.uvs[i].y, mesh.positions[i].y, 1e-6);
      EXPECT_NEAR(mesh.normals[i].z, 1, 1e-6);
    }
  }
};

TEST_F(PackedGltf, DracoMeshesComeBack) {
  for (const int method : {draco::MESH_SEQUENTIAL_ENCODING, draco::MESH_EDGEBREAKER_ENCODING}) {
    pack_by_draco(packed_square(method));
    expect_square(mesh_of(clean_document()));
  }
}

TEST_F(PackedGltf, TheDracoStreamIsTrusted) {
  // As the official samples have it: accessors that say other types and counts than the stream.
  pack_by_draco(packed_square(draco::MESH_EDGEBREAKER_ENCODING));
  document_["accessors"][0]["count"] = 5;
  document_["accessors"][1]["componentType"] = 5120;
  document_["accessors"][2]["componentType"] = 5123;
  expect_square(mesh_of(clean_document()));
}

TEST_F(PackedGltf, DamagedDracoIsTold) {
  const std::string packed = packed_square(draco::MESH_EDGEBREAKER_ENCODING);
  pack_by_draco(packed.substr(0, packed.size() / 2));
  EXPECT_TRUE(has_error(load_document(), "its Draco mesh"));
  pack_by_draco("DRACO is another thing");
  EXPECT_TRUE(has_error(load_document(), "its Draco mesh"));
  std::string older = packed;
  older[6] = 1;
  pack_by_draco(older);
  EXPECT_TRUE(has_error(load_document(), "bitstream version 2.1; glTF's is 2.2"));
  // A header of two thousand million faces and nothing behind it.
  std::string huge = packed.substr(0, 11) + std::string(1, '\0') + std::string("\xff\xff\xff\xff\x07", 5) +
                     std::string("\xff\xff\xff\xff\x07", 5) + packed.substr(14);
  pack_by_draco(huge);
  EXPECT_TRUE(has_error(load_document(), "would not fit into memory"));
  pack_by_draco(packed);
  primitive()["extensions"]["KHR_draco_mesh_compression"]["attributes"]["NORMAL"] = 7;
  EXPECT_TRUE(mentions(load_document(), "/NORMAL: is no attribute of the Draco mesh"));
  primitive()["extensions"]["KHR_draco_mesh_compression"]["attributes"]["POSITION"] = 7;
  EXPECT_TRUE(has_error(load_document(), "/POSITION: is no attribute of the Draco mesh"));
  // Positions that Draco does not hold: fewer than its triangles ask for.
  primitive()["extensions"]["KHR_draco_mesh_compression"]["attributes"] = nlohmann::json::object();
  for (size_t i = 0; i < 3; ++i) document_["accessors"][i]["count"] = 2;
  EXPECT_TRUE(has_error(load_document(), "have 2 positions, but the Draco mesh has 4 vertices"));
}

TEST_F(PackedGltf, MeshoptViewsComeBack) {
  pack_by_meshopt();
  expect_square(mesh_of(clean_document()));
}

TEST_F(PackedGltf, MeshoptFiltersAreApplied) {
  pack_by_meshopt();
  std::vector<signed char> octahedral(16);
  const float up[] = {0, 0, 1, 0};
  for (size_t i = 0; i < 4; ++i) meshopt_encodeFilterOct(octahedral.data() + 4 * i, 1, 4, 8, up);
  const int normals =
      add_packed_view(packed_vertices(octahedral.data(), 4, 4), "ATTRIBUTES", 4, 4, "OCTAHEDRAL");
  document_["bufferViews"][static_cast<size_t>(normals)]["byteStride"] = 4;
  document_["accessors"][1] = {
      {"bufferView", normals}, {"componentType", 5120}, {"normalized", true}, {"count", 4}, {"type", "VEC3"}};
  std::vector<unsigned int> exponential(8);
  meshopt_encodeFilterExp(exponential.data(), 4, 8, 15, positions() + 24);
  const int uvs =
      add_packed_view(packed_vertices(exponential.data(), 4, 8), "ATTRIBUTES", 4, 8, "EXPONENTIAL");
  document_["accessors"][2] = {{"bufferView", uvs}, {"componentType", 5126}, {"count", 4}, {"type", "VEC2"}};
  expect_square(mesh_of(clean_document()));
}

TEST_F(PackedGltf, WrongMeshoptIsTold) {
  pack_by_meshopt();
  const json good = meshopt_extension();
  const auto expect = [&](const char* key, const json& value, const char* message) {
    meshopt_extension() = good;
    meshopt_extension()[key] = value;
    EXPECT_TRUE(has_error(load_document(), message)) << key;
  };
  expect("mode", "TRIANGLE", "must be ATTRIBUTES, TRIANGLES or INDICES");
  expect("byteStride", 13, "must be a multiple of 4");
  expect("byteStride", 300, "must be a number from 1 to 256");
  expect("filter", "COLOR", "must be NONE, OCTAHEDRAL");
  expect("filter", "OCTAHEDRAL", "must be 4 or 8");
  expect("filter", "QUATERNION", "must be 8");
  expect("byteLength", 3, "can't be unpacked; the file is damaged");
  expect("byteLength", 1'000'000, "reaches to byte 1000000");
  expect("count", 3'000'000'000, "would not fit into memory");
  std::string newer = packed_vertices(positions(), 4, 12);
  newer[0] = '\xa1';
  const int view = add_packed_view(newer, "ATTRIBUTES", 4, 12);
  document_["accessors"][0]["bufferView"] = view;
  EXPECT_TRUE(has_error(load_document(), "is packed by version 1 of the codec"));
}

TEST_F(PackedGltf, TheRatifiedNameIsRead) {
  pack_by_meshopt();
  for (json& view : document_["bufferViews"]) {
    if (!view.contains("extensions")) continue;
    view["extensions"]["KHR_meshopt_compression"] = view["extensions"]["EXT_meshopt_compression"];
    view["extensions"].erase("EXT_meshopt_compression");
  }
  document_["extensionsRequired"] = {"KHR_meshopt_compression"};
  expect_square(mesh_of(clean_document()));
}

TEST_F(PackedGltf, AnyDamageEndsInASceneOrALine) {
  std::mt19937 random(5);
  const std::string packed[] = {packed_square(draco::MESH_EDGEBREAKER_ENCODING),
                                packed_square(draco::MESH_SEQUENTIAL_ENCODING)};
  int failed = 0;
  for (int i = 0; i < 400; ++i) {
    std::string bytes = packed[i % 2];
    for (int edits = 1 + i % 3; edits > 0; --edits)
      bytes[11 + random() % (bytes.size() - 11)] = static_cast<char>(random());
    pack_by_draco(bytes);
    failed += load_document().ok() ? 0 : 1;
  }
  EXPECT_GT(failed, 40);
}

}  // namespace
}  // namespace lightmill
