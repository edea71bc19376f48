// Smoke fuzz of the scene and mesh readers: seeded mutations of valid files. Whatever comes in, a load ends
// with a list of problems or a scene, and a mesh with a mesh or an Error.
#include <random>

#include "common/base/error.h"
#include "common/scene/mesh/ply_reader.h"
#include "common/scene/resolve_settings.h"
#include "tests/common/scene/gltf/gltf_fixture.h"

namespace lightmill {
namespace {

constexpr const char* kScene = R"(# comment
Scale -1 1 1 LookAt 0 1 6.8  0 1 0  0 1 0
Camera "perspective" "float fov" 19.5 "float screenwindow" [-1 1 -1 1]
Sampler "sobol" "integer pixelsamples" 16
Integrator "bdpt" "integer maxdepth" 6
PixelFilter "gaussian" "float sigma" 0.5
Film "rgb" "integer xresolution" 64 "integer yresolution" 64 "string filename" "b\"x.exr" "float cropwindow" [0 1 0 1]
WorldBegin
Attribute "shape" "float radius" 2
Texture "t" "spectrum" "checkerboard" "rgb tex1" [1 0 0] "float uscale" 4
MakeNamedMaterial "m" "string type" "coateddiffuse" "texture reflectance" "t" "float roughness" 0.1
AttributeBegin
  AreaLightSource "diffuse" "blackbody L" 4500 "float power" 10
  Shape "trianglemesh" "point3 P" [-1 2 -1 1 2 -1 1 2 1 -1 2 1] "integer indices" [0 1 2 0 2 3] "normal N" [0 1 0 0 1 0 0 1 0 0 1 0]
AttributeEnd
NamedMaterial "m" Shape "sphere"
Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" [400 1 500 2 600 3]
ObjectBegin "o" Rotate 30 0 1 0 Shape "sphere" "float radius" 0.4 ObjectEnd
Translate 1 2 3 ObjectInstance "o" ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 4 5 6 1] ObjectInstance "o"
LightSource "point" "rgb I" [1 2 3] "point3 from" [0 0 1]
)";

const std::vector<std::string> kWords = {"\"",
                                         "[",
                                         "]",
                                         "#",
                                         "\\",
                                         "nan",
                                         "1e999",
                                         "-1",
                                         "0",
                                         "1e-320",
                                         "4294967296",
                                         "\"float radius\"",
                                         "AttributeBegin",
                                         "AttributeEnd",
                                         "ObjectBegin \"p\"",
                                         "ObjectEnd",
                                         "Include \"scene.pbrt\"",
                                         "Import \"scene.pbrt\"",
                                         "WorldBegin",
                                         "ReverseOrientation",
                                         "\"texture scale\" \"t\"",
                                         "Scale 0 0 0",
                                         "ActiveTransform EndTime",
                                         "TransformBegin"};

using Random = std::mt19937_64;

size_t below(Random& random, size_t n) { return n == 0 ? 0 : random() % n; }

/// A few random edits: bytes, words, cuts, repeated stretches.
std::string mutated(std::string text, Random& random, const std::vector<std::string>& words) {
  const size_t edits = 1 + below(random, 6);
  for (size_t i = 0; i < edits; ++i) {
    const size_t at = below(random, text.size() + 1);
    switch (below(random, 7)) {
      case 0:
        if (at < text.size()) text[at] = static_cast<char>(random());
        break;
      case 1:
        text.insert(at, 1, static_cast<char>(random()));
        break;
      case 2:
        text.erase(at, below(random, 20));
        break;
      case 3:
        if (below(random, 4) == 0) text.resize(at);
        break;
      case 4:
        text.insert(at, text.substr(below(random, text.size() + 1), below(random, 80)));
        break;
      case 5:
        if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1 << below(random, 8)));
        break;
      default:
        if (!words.empty()) text.insert(at, " " + words[below(random, words.size())] + " ");
        break;
    }
  }
  return text;
}

class ReaderFuzz : public SceneTest {};

TEST_F(ReaderFuzz, Scenes) {
  ASSERT_TRUE(load(kScene).ok()) << listed(load(kScene));
  size_t accepted = 0;
  for (uint64_t seed = 0; seed < 3000; ++seed) {
    Random random(seed);
    const std::string text = mutated(kScene, random, kWords);
    SCOPED_TRACE(seed);
    const LoadResult r = load(text);
    EXPECT_LE(r.problems.size(), static_cast<size_t>(3000));
    for (const Problem& p : r.problems) {
      EXPECT_EQ(format_problem(p).find('\n'), std::string::npos) << format_problem(p);
      EXPECT_GE(p.where.line, 1);
      EXPECT_GE(p.where.column, 1);
    }
    if (!r.ok()) continue;
    ++accepted;
    const auto in = [](int index, size_t count) { return index >= -1 && index < static_cast<int>(count); };
    for (const ShapeDescription& s : r.scene.shapes) {
      EXPECT_TRUE(s.material >= 0 && in(s.material, r.scene.materials.size()));
      EXPECT_TRUE(in(s.area_light, r.scene.area_lights.size()));
    }
    for (const InstanceDescription& i : r.scene.instances)
      EXPECT_TRUE(i.object >= 0 && in(i.object, r.scene.objects.size()));
    EXPECT_NO_THROW(resolve_settings(r.scene, {}));
  }
  EXPECT_GT(accepted, 30u) << "some mutations are harmless, or the test tests nothing";
}

std::string ply(bool binary) {
  std::string text =
      std::string("ply\nformat ") + (binary ? "binary_little_endian" : "ascii") +
      " 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nproperty float u\n"
      "property float v\nelement face 3\nproperty list uchar int vertex_indices\nend_header\n";
  const float vertices[5][5] = {
      {0, 0, 0, 0, 0}, {1, 0, 0, 1, 0}, {1, 1, 0, 1, 1}, {0, 1, 0, 0, 1}, {0, 0, 1, 0, 0}};
  const std::vector<int> faces[3] = {{0, 1, 2}, {0, 2, 3, 4}, {4, 1, 0}};
  for (const auto& v : vertices) {
    for (float x : v)
      text += binary ? std::string(reinterpret_cast<const char*>(&x), 4) : std::to_string(x) + " ";
  }
  for (const auto& f : faces) {
    text += binary ? std::string(1, static_cast<char>(f.size())) : std::to_string(f.size()) + " ";
    for (int i : f)
      text += binary ? std::string(reinterpret_cast<const char*>(&i), 4) : std::to_string(i) + " ";
  }
  return text;
}

TEST(MeshFuzz, Ply) {
  const std::vector<std::string> words = {"99999999999",
                                          "property list uint double q",
                                          "element vertex 7",
                                          "list",
                                          "-3",
                                          "end_header\n",
                                          "\n",
                                          "binary_big_endian",
                                          "nan"};
  for (bool binary : {false, true}) {
    const std::string valid = ply(binary);
    ASSERT_EQ(parse_ply(valid).triangles.size(), 4u);
    size_t accepted = 0;
    for (uint64_t seed = 0; seed < 20000; ++seed) {
      Random random(seed);
      try {
        const TriangleMesh mesh = parse_ply(mutated(valid, random, words));
        ++accepted;
        for (const auto& t : mesh.triangles) {
          for (uint32_t v : t) ASSERT_LT(v, mesh.positions.size()) << seed;
        }
      } catch (const Error& e) {
        ASSERT_EQ(std::string(e.what()).find('\n'), std::string::npos) << seed;
      }
    }
    EXPECT_GT(accepted, 100u);
  }
}

class GltfFuzz : public GltfTest {};

TEST_F(GltfFuzz, Scenes) {
  const std::vector<std::string> words = {"-1",
                                          "0",
                                          "1e300",
                                          "4294967296",
                                          "null",
                                          "[]",
                                          "{}",
                                          "\"\"",
                                          "\"children\": [0],",
                                          "\"sparse\": {},",
                                          "\"normalized\": true,",
                                          "\"mode\": 5,",
                                          "\"byteOffset\": 3,",
                                          "\"byteStride\": 4,",
                                          "\"extensions\": {\"KHR_lights_punctual\": {\"light\": 0}},",
                                          "data:;base64,AAAA"};
  primitive()["attributes"]["COLOR_0"] = 0;
  document_["materials"][0]["alphaMode"] = "BLEND";
  document_["materials"][0]["pbrMetallicRoughness"] = {{"baseColorFactor", {1, 1, 1, 0.5}},
                                                       {"metallicFactor", 0}};
  document_["materials"][0]["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 0.5;
  document_["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "spot"}, {"spot", {}}}};
  nlohmann::json in_glb = document_;
  in_glb["buffers"][0].erase("uri");
  const std::string valid = document_.dump(), binary = glb(in_glb, square_);
  ASSERT_TRUE(load_text(valid).ok()) << listed(load_text(valid));
  size_t accepted = 0;
  for (uint64_t seed = 0; seed < 4000; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const bool packed = seed % 2 == 1;
    const std::string name = packed ? "scene.glb" : "scene.gltf";
    folder_.write(name, mutated(packed ? binary : valid, random, words));
    const LoadResult r = load_scene(name, DirectoryFiles(folder_.path()));
    for (const Problem& p : r.problems) {
      EXPECT_EQ(format_problem(p).find('\n'), std::string::npos) << format_problem(p);
      EXPECT_GE(p.where.line, 1);
      EXPECT_GE(p.where.column, 1);
    }
    if (!r.ok()) continue;
    ++accepted;
    for (const ShapeDescription& s : r.scene.shapes) {
      EXPECT_TRUE(s.material >= 0 && s.material < static_cast<int>(r.scene.materials.size()));
      const TriangleMesh& mesh = *std::get<MeshShape>(s.kind).mesh;
      for (const auto& t : mesh.triangles) {
        for (uint32_t v : t) ASSERT_LT(v, mesh.positions.size());
      }
    }
    EXPECT_NO_THROW(resolve_settings(r.scene, {}));
  }
  EXPECT_GT(accepted, 100u);
}

}  // namespace
}  // namespace lightmill
