// extras.lightgroup of lights, materials and nodes.
#include "tests/common/scene/gltf/gltf_fixture.h"

namespace lightmill {
namespace {

class GltfLightGroups : public GltfTest {
 protected:
  /// Adds a node to the scene; returns it.
  nlohmann::json& add_node(const nlohmann::json& node) {
    document_["nodes"].push_back(node);
    document_["scenes"][0]["nodes"].push_back(document_["nodes"].size() - 1);
    return document_["nodes"].back();
  }
  nlohmann::json& add_light() {
    document_["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
    return add_node({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  }
  nlohmann::json& light() { return document_["extensions"]["KHR_lights_punctual"]["lights"][0]; }
  nlohmann::json& material() { return document_["materials"][0]; }
  static nlohmann::json group(const nlohmann::json& name) { return {{"lightgroup", name}}; }
  static std::string group_of(const SceneDescription& scene, const ShapeDescription& shape) {
    return scene.area_lights.at(static_cast<size_t>(shape.area_light)).light_group;
  }
};

TEST_F(GltfLightGroups, OfLightsTheNodeWins) {
  add_light();
  EXPECT_EQ(clean_document().lights.at(0).light_group, "");
  light()["extras"] = group("key");
  EXPECT_EQ(clean_document().lights.at(0).light_group, "key");
  document_["nodes"][2]["extras"] = group("fill");
  EXPECT_EQ(clean_document().lights.at(0).light_group, "fill");
  document_["nodes"][2]["extras"] = group("rest");
  EXPECT_EQ(clean_document().lights.at(0).light_group, "") << "a node may also say that there is none";
}

TEST_F(GltfLightGroups, OfMeshesTheNodeWins) {
  material()["extras"] = group("screens");
  SceneDescription s = clean_document();
  EXPECT_EQ(group_of(s, s.shapes.at(0)), "screens");
  document_["nodes"][0]["extras"] = group("key");
  s = clean_document();
  EXPECT_EQ(group_of(s, s.shapes.at(0)), "key");
}

TEST_F(GltfLightGroups, UnlitSurfacesShine) {
  material() = {{"extensions", {{"KHR_materials_unlit", nlohmann::json::object()}}},
                {"extras", group("screens")}};
  const SceneDescription s = clean_document();
  EXPECT_EQ(group_of(s, s.shapes.at(0)), "screens");
}

TEST_F(GltfLightGroups, NodesShareAMeshInSeveralGroups) {
  material()["extras"] = group("screens");
  add_node({{"mesh", 0}, {"extras", group("key")}});
  add_node({{"mesh", 0}, {"extras", group("key")}});
  add_node({{"mesh", 0}, {"extras", group("")}});
  const SceneDescription s = clean_document();
  ASSERT_EQ(s.shapes.size(), 2u);
  EXPECT_EQ(group_of(s, s.shapes[0]), "screens");
  EXPECT_EQ(group_of(s, s.shapes[1]), "");
  ASSERT_EQ(s.objects.size(), 1u);
  EXPECT_EQ(group_of(s, s.objects[0].shapes.at(0)), "key");
  EXPECT_EQ(s.instances.size(), 2u);
  EXPECT_EQ(s.area_lights.size(), 3u) << "one a group";
  EXPECT_EQ(&mesh_of(s, 0), &mesh_of(s, 1));
}

TEST_F(GltfLightGroups, WhatDoesNotEmitIsSharedWhateverItsGroup) {
  material() = {{"extras", group("screens")}};
  add_node({{"mesh", 0}, {"extras", group("key")}});
  add_light();
  const SceneDescription s = clean_document();
  EXPECT_EQ(s.objects.size(), 1u);
  EXPECT_EQ(s.instances.size(), 2u);
  EXPECT_TRUE(s.area_lights.empty());
}

TEST_F(GltfLightGroups, OtherTypesAreNamedOnce) {
  material()["extras"] = group(7);
  const LoadResult r = load_document();
  EXPECT_EQ(r.problems.size(), 1u) << listed(r);
  EXPECT_TRUE(mentions(r, "/materials/0/extras/lightgroup: should be a string; it is left out")) << listed(r);
  EXPECT_EQ(r.scene.area_lights.at(0).light_group, "");
  for (const nlohmann::json& extras :
       {nlohmann::json("mine"), nlohmann::json(3), nlohmann::json::array({"lightgroup"})}) {
    material()["extras"] = extras;
    clean_document();
  }
}

TEST_F(GltfLightGroups, NamesThatChangeAreNamed) {
  material()["extras"] = group("the screens");
  add_light()["extras"] = group("key.light");
  const LoadResult r = load_document();
  EXPECT_EQ(group_of(r.scene, r.scene.shapes.at(0)), "the_screens");
  EXPECT_EQ(r.scene.lights.at(0).light_group, "key_light");
  EXPECT_TRUE(
      mentions(r, "/materials/0/extras/lightgroup: the group \"the screens\" gets the name \"the_screens\""))
      << listed(r);
}

}  // namespace
}  // namespace lightmill
