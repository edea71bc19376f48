// What Cryptomatte calls the shapes and instances of a pbrt file, and of nodes of a glTF file.
#include "common/scene/cryptomatte/part_names.h"

#include "tests/common/scene/gltf/gltf_fixture.h"
#include "tests/common/scene/scene_fixture.h"

namespace lightmill {
namespace {

std::string text_of(const SceneDescription& scene, int name) {
  return name < 0 ? "" : scene.names.names().at(static_cast<size_t>(name));
}
std::string object_of(const SceneDescription& scene, const PartNames& names) {
  return text_of(scene, names.object);
}
std::string asset_of(const SceneDescription& scene, const PartNames& names) {
  return text_of(scene, names.asset);
}

class PartNamesOfPbrt : public SceneTest {};

TEST_F(PartNamesOfPbrt, ShapesSayWhatTheyAre) {
  const SceneDescription s = clean_world(R"(
Shape "sphere" "string object" "ball" "string asset" "toys"
AttributeBegin
  Attribute "shape" "string object" "drum" "string materialname" "skin"
  Shape "disk"
  Shape "disk" "string object" "lid"
AttributeEnd
Shape "sphere"
)");
  ASSERT_EQ(s.shapes.size(), 4u);
  EXPECT_EQ(object_of(s, s.shapes[0].names), "ball");
  EXPECT_EQ(asset_of(s, s.shapes[0].names), "toys");
  EXPECT_EQ(object_of(s, s.shapes[1].names), "drum");
  EXPECT_EQ(text_of(s, s.shapes[1].names.material), "skin");
  EXPECT_EQ(asset_of(s, s.shapes[1].names), "scene.pbrt");
  EXPECT_EQ(object_of(s, s.shapes[2].names), "lid");
  EXPECT_EQ(object_of(s, s.shapes[3].names), "shape scene.pbrt:9");
  EXPECT_EQ(s.shapes[3].names.material, -1);
}

TEST_F(PartNamesOfPbrt, ThingsMayHaveNumbers) {
  const SceneDescription s = clean_world(R"(
Shape "sphere" "integer objectid" 7 "integer materialid" 0
ObjectBegin "tree"
  Shape "sphere" "integer objectid" 3 "string materialname" "bark"
ObjectEnd
ObjectInstance "tree" "integer objectid" 4
ObjectInstance "tree"
)");
  EXPECT_EQ(s.shapes.at(0).names.object_id, 7);
  EXPECT_EQ(s.shapes.at(0).names.material_id, 0);
  const PartNames& shape = s.objects.at(0).shapes.at(0).names;
  EXPECT_EQ(named_by(s.instances.at(0).names, shape).object_id, 4);
  EXPECT_EQ(named_by(s.instances.at(1).names, shape).object_id, 3);
  EXPECT_EQ(shape.material_id, -1);
  EXPECT_EQ(text_of(s, shape.material), "bark");
}

TEST_F(PartNamesOfPbrt, InstancesMayHaveNamesOfTheirOwn) {
  const SceneDescription s = clean_world(R"(
ObjectBegin "tree"
  Shape "sphere"
  Shape "sphere" "string object" "leaf"
ObjectEnd
ObjectInstance "tree"
ObjectInstance "tree" "string object" "oak" "string asset" "wood"
)");
  const auto& shapes = s.objects.at(0).shapes;
  EXPECT_EQ(object_of(s, shapes.at(0).names), "tree");
  EXPECT_EQ(asset_of(s, shapes.at(0).names), "tree");
  EXPECT_EQ(object_of(s, shapes.at(1).names), "leaf");
  EXPECT_EQ(s.instances.at(0).names, PartNames());
  EXPECT_EQ(object_of(s, s.instances.at(1).names), "oak");
  EXPECT_EQ(asset_of(s, named_by(s.instances.at(1).names, shapes.at(1).names)), "wood");
}

TEST_F(PartNamesOfPbrt, MaterialsGoByNameOrByKindAndPlace) {
  const SceneDescription s = clean_world(R"(
MakeNamedMaterial "chalk" "string type" "diffuse"
NamedMaterial "chalk"
Shape "sphere"
Material "conductor"
Shape "sphere"
)");
  ASSERT_EQ(s.shapes.size(), 2u);
  const auto name = [&](const ShapeDescription& shape) {
    return name_of_material(s.materials.at(static_cast<size_t>(shape.material)));
  };
  EXPECT_EQ(name(s.shapes[0]), "chalk");
  EXPECT_EQ(name(s.shapes[1]), "conductor scene.pbrt:6");
}

class PartNamesOfGltf : public GltfTest {};

TEST_F(PartNamesOfGltf, AreThoseOfNodesAndRoots) {
  document_["nodes"][0]["name"] = "chair";
  SceneDescription s = clean_document();
  EXPECT_EQ(object_of(s, s.shapes.at(0).names), "chair");
  EXPECT_EQ(asset_of(s, s.shapes.at(0).names), "chair");
  // Below a root of its own, twice: instances.
  document_["nodes"].push_back({{"mesh", 0}});
  document_["nodes"].push_back({{"name", "room"}, {"children", {document_["nodes"].size() - 1}}});
  document_["scenes"][0]["nodes"].push_back(document_["nodes"].size() - 1);
  s = clean_document();
  ASSERT_EQ(s.instances.size(), 2u);
  EXPECT_EQ(object_of(s, s.instances[0].names), "chair");
  EXPECT_EQ(object_of(s, s.instances[1].names), "node 2");
  EXPECT_EQ(asset_of(s, s.instances[1].names), "room");
}

}  // namespace
}  // namespace lightmill
