// Skins and morph targets against meshes bent by hand.
#include <cmath>
#include <limits>

#include "common/scene/transform.h"
#include "tests/common/scene/gltf/animation/animation_fixture.h"

namespace lightmill {
namespace {

using nlohmann::json;

class GltfDeformation : public AnimatedGltf {
 protected:
  /// The square is carried by two joints: its left side by node 2, at the origin, its right side by node 3,
  /// which hangs from 2 and is at (1, 0, 0).
  void skin() {
    document_["scenes"][0]["nodes"] = {0, 1, 2};
    document_["nodes"].push_back({{"children", {3}}});
    document_["nodes"].push_back({{"translation", {1, 0, 0}}});
    const std::vector<float> binds = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0,  0, 0, 1,
                                      1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1};
    document_["skins"] = {{{"joints", {2, 3}}, {"inverseBindMatrices", floats(binds, "MAT4", 16)}}};
    document_["nodes"][0]["skin"] = 0;
    joints({0, 1, 1, 0});
    weights({1, 1, 1, 1});
  }
  void joints(const std::vector<uint8_t>& of) {
    std::vector<uint8_t> all;
    for (const uint8_t j : of) all.insert(all.end(), {j, 0, 0, 0});
    primitive()["attributes"]["JOINTS_0"] = add_accessor(raw_bytes(all), kUnsignedByte, 4, "VEC4");
  }
  void weights(const std::vector<float>& of) {
    std::vector<float> all;
    for (const float w : of) all.insert(all.end(), {w, 0, 0, 0});
    primitive()["attributes"]["WEIGHTS_0"] = floats(all, "VEC4", 4);
  }
  /// Node 3 turns about z by 90 degrees in 1 s.
  void turn() {
    const float h = std::sqrt(0.5f);
    channel(node(3, "rotation"), {0, 1}, floats({0, 0, 0, 1, 0, 0, h, h}, "VEC4", 4));
  }
  /// Its first target lifts corner 2 by (1, 2, 3), the second moves all by (0, 0, 10).
  void morph() {
    primitive()["targets"] = {{{"POSITION", floats({0, 0, 0, 0, 0, 0, 1, 2, 3, 0, 0, 0}, "VEC3", 3)}},
                              {{"POSITION", floats({0, 0, 10, 0, 0, 10, 0, 0, 10, 0, 0, 10}, "VEC3", 3)}}};
  }
};

TEST_F(GltfDeformation, JointsCarryVertices) {
  skin();
  turn();
  // In the pose in which it was bound the square is as it was, wherever its node is.
  document_["nodes"][0]["translation"] = {5, 5, 5};
  expect_near(corner(clean_document(), 2), {1, 1, 0});
  for (const double t : {0.0, 0.3, 0.5, 0.8}) {
    const double angle = t * M_PI / 2;
    const SceneDescription s = clean_at(t);
    expect_near(corner(s, 0), {0, 0, 0});
    expect_near(corner(s, 3), {0, 1, 0});
    expect_near(corner(s, 1), {1, 0, 0});
    expect_near(corner(s, 2), {1 - std::sin(angle), std::cos(angle), 0});
  }
}

TEST_F(GltfDeformation, JointsBlend) {
  skin();
  turn();
  std::vector<uint8_t> j;
  for (int i = 0; i < 4; ++i) j.insert(j.end(), {0, 1, 0, 0});
  primitive()["attributes"]["JOINTS_0"] = add_accessor(raw_bytes(j), kUnsignedByte, 4, "VEC4");
  std::vector<float> w;
  for (int i = 0; i < 4; ++i) w.insert(w.end(), {0.25f, 0.75f, 0, 0});
  primitive()["attributes"]["WEIGHTS_0"] = floats(w, "VEC4", 4);
  // Corner 2 at (1, 1, 0) stays by a quarter and goes to (0, 0, 0) by three.
  expect_near(corner(clean_at(1), 2), {0.25, 0.25, 0});
}

TEST_F(GltfDeformation, EightInfluences) {
  skin();
  turn();
  std::vector<uint8_t> j;
  std::vector<float> first, second;
  for (int i = 0; i < 4; ++i) {
    j.insert(j.end(), {1, 1, 0, 0});
    first.insert(first.end(), {0.25f, 0.25f, 0, 0});
    second.insert(second.end(), {0.125f, 0.125f, 0.125f, 0.125f});
  }
  primitive()["attributes"]["JOINTS_0"] = add_accessor(raw_bytes(j), kUnsignedByte, 4, "VEC4");
  primitive()["attributes"]["JOINTS_1"] = add_accessor(raw_bytes(j), kUnsignedByte, 4, "VEC4");
  primitive()["attributes"]["WEIGHTS_0"] = floats(first, "VEC4", 4);
  primitive()["attributes"]["WEIGHTS_1"] = floats(second, "VEC4", 4);
  // Three quarters of joint 1, one of joint 0.
  expect_near(corner(clean_at(1), 2), {0.25, 0.25, 0});
}

TEST_F(GltfDeformation, NormalsTurnAlongAndStayPerpendicular) {
  skin();
  // Both joints stretch by 4 along x; normals that lean in x lean less.
  document_["nodes"][2]["scale"] = {4, 1, 1};
  std::vector<float> normals;
  for (int i = 0; i < 4; ++i) normals.insert(normals.end(), {0.6f, 0, 0.8f});
  primitive()["attributes"]["NORMAL"] = floats(normals, "VEC3", 3);
  const SceneDescription s = clean_document();
  const Vec3f n = mesh_of(s).normals.at(0);
  const double x = 0.6 / 4, z = 0.8, length = std::hypot(x, z);
  expect_near({double{n.x}, double{n.y}, double{n.z}}, {x / length, 0, z / length});
  // A joint that mirrors keeps them on the same side of the surface.
  document_["nodes"][2]["scale"] = {-1, 1, 1};
  const Vec3f m = mesh_of(clean_document()).normals.at(0);
  expect_near({double{m.x}, double{m.y}, double{m.z}}, {-0.6, 0, 0.8});
}

TEST_F(GltfDeformation, SkinsOfDamage) {
  skin();
  const auto says = [&](const std::string& what) {
    const LoadResult r = load_document(at(0));
    EXPECT_TRUE(r.ok() && mentions(r, what)) << listed(r) << what;
    return r.scene;
  };
  weights({2, 0.5f, 1, 1});
  expect_near(corner(says("2 vertices have weights whose sum is not 1; they are normalised"), 2), {1, 1, 0});
  weights({0, 1, 1, std::numeric_limits<float>::quiet_NaN()});
  expect_near(corner(says("2 vertices have no weight above 0; the first of their joints carries them"), 3),
              {0, 1, 0});
  weights({1, 1, 1, 1});
  joints({0, 1, 9, 0});
  says("1 weights are of joints that the skin does not have; they are left out");
  primitive()["attributes"].erase("JOINTS_0");
  expect_near(corner(says("has a skin but no JOINTS_0 and WEIGHTS_0"), 2), {1, 1, 0});
  skin();
  const json whole = document_;
  document_["skins"][0]["joints"] = {2, 99};
  says("refers to node 99");
  document_["skins"][0]["joints"] = json::array();
  says("has no joints");
  document_["nodes"][0]["skin"] = 7;
  says("refers to skin 7");
  document_ = whole;
  document_["skins"][0]["inverseBindMatrices"] = 0;
  says("has 3 component(s)");
  document_["skins"][0].erase("inverseBindMatrices");
  clean_at(0);
  // A skeleton that goes round in a circle, away from the scene.
  document_ = whole;
  document_["scenes"][0]["nodes"] = {0, 1};
  document_["nodes"][2]["translation"] = {3, 0, 0};
  document_["nodes"][3]["children"] = {2};
  says("hangs from itself; its parent is left out");
}

TEST_F(GltfDeformation, MorphTargetsAdd) {
  morph();
  document_["meshes"][0]["weights"] = {0.5, 0};
  expect_near(corner(clean_document(), 2), {1.5, 2, 1.5});
  expect_near(corner(clean_document(), 0), {0, 0, 0});
  document_["nodes"][0]["weights"] = {1, 0.1};
  expect_near(corner(clean_document(), 2), {2, 3, 4});
  channel(node(0, "weights"), {0, 1}, floats({0, 0, 2, -1}, "SCALAR", 1));
  expect_near(corner(clean_at(0.5), 2), {2, 3, -2});
  // As a cubic spline, per key all in-tangents, then all values, then all out-tangents.
  document_["animations"] = json::array();
  channel(node(0, "weights"), {0, 1}, floats({0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0}, "SCALAR", 1),
          "CUBICSPLINE");
  expect_near(corner(clean_at(0.5), 2), {1.5, 2, 6.5});
}

TEST_F(GltfDeformation, MorphTargetsByMeshesAndOneByOne) {
  morph();
  channel(pointer("/meshes/0/weights"), {0, 1}, floats({0, 0, 1, 0.5f}, "SCALAR", 1));
  expect_near(corner(clean_at(1), 2), {2, 3, 8});
  document_["animations"] = json::array();
  channel(pointer("/nodes/0/weights/1"), {0, 1}, floats({0, 0.5f}, "SCALAR", 1));
  expect_near(corner(clean_at(1), 2), {1, 1, 5});
  document_["meshes"][0]["weights"] = {1, 0};
  expect_near(corner(clean_at(1), 2), {2, 3, 8});
}

TEST_F(GltfDeformation, SparseMorphTargetsAreTheSameAsDenseOnes) {
  morph();
  document_["meshes"][0]["weights"] = {1, 0};
  const SceneDescription dense = clean_document();
  const auto view = [&](const std::string& bytes, int type, const std::string& name) {
    const int a = add_accessor(bytes, type, 1, name);
    return document_["accessors"][static_cast<size_t>(a)]["bufferView"];
  };
  const json indices = view(raw_bytes<uint8_t>({2}), kUnsignedByte, "SCALAR");
  const json values = view(raw_bytes<float>({1, 2, 3}), kFloat, "VEC3");
  document_["accessors"].push_back(
      {{"componentType", kFloat},
       {"count", 4},
       {"type", "VEC3"},
       {"sparse",
        {{"count", 1},
         {"indices", {{"bufferView", indices}, {"componentType", kUnsignedByte}}},
         {"values", {{"bufferView", values}}}}}});
  primitive()["targets"][0]["POSITION"] = document_["accessors"].size() - 1;
  const SceneDescription sparse = clean_document();
  for (size_t i = 0; i < 4; ++i) expect_near(corner(sparse, i), corner(dense, i), 0);
}

TEST_F(GltfDeformation, NormalsMorphAndTangentsAreAllowed) {
  primitive()["targets"] = {{{"NORMAL", floats({1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3", 3)},
                             {"TANGENT", floats({1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3", 3)}}};
  document_["meshes"][0]["weights"] = {1};
  const SceneDescription s = clean_document();
  const Vec3f n = mesh_of(s).normals.at(0);
  const double h = std::sqrt(0.5);
  expect_near({double{n.x}, double{n.y}, double{n.z}}, {h, 0, h});
  expect_near(corner(s, 2), {1, 1, 0});
}

TEST_F(GltfDeformation, TargetsGoBeforeJoints) {
  skin();
  turn();
  morph();
  document_["meshes"][0]["weights"] = {1, 0};
  // (2, 3, 3) is (1, 3, 3) from the joint; a quarter turn makes it (-3, 1, 3).
  expect_near(corner(clean_at(1), 2), {-2, 1, 3});
}

TEST_F(GltfDeformation, DamagedTargets) {
  morph();
  document_["meshes"][0]["weights"] = {1, 1};
  primitive()["targets"][0]["POSITION"] = floats({0, 0, 0}, "VEC3", 3);
  LoadResult r = load_document();
  EXPECT_TRUE(r.ok() && mentions(r, "POSITION has 1 elements for 4 vertices; it is left out")) << listed(r);
  expect_near(corner(r.scene, 2), {1, 1, 10});
  primitive()["targets"] = 5;
  EXPECT_TRUE(load_document().ok());
  morph();
  document_["meshes"][0]["weights"] = {1, 1, 1, 1, 1};
  expect_near(corner(load_document().scene, 2), {2, 3, 13});
  primitive()["targets"][0]["POSITION"] = 77;
  r = load_document();
  EXPECT_TRUE(r.ok() && mentions(r, "refers to accessor 77")) << listed(r);
}

TEST_F(GltfDeformation, NodesWithTheSameWeightsShareTheirMesh) {
  morph();
  document_["scenes"][0]["nodes"] = {0, 1, 2, 3};
  document_["nodes"].push_back({{"mesh", 0}, {"weights", {1, 0}}});
  document_["nodes"].push_back({{"mesh", 0}, {"weights", {1, 0}}});
  const SceneDescription s = clean_document();
  EXPECT_EQ(s.shapes.size(), 1u);
  ASSERT_EQ(s.objects.size(), 1u);
  EXPECT_EQ(s.instances.size(), 2u);
  EXPECT_EQ(std::get<MeshShape>(s.objects[0].shapes[0].kind).mesh->positions[2].z, 3);
}

}  // namespace
}  // namespace lightmill
