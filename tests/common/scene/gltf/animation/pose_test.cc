// What animations move, at given times, against closed positions; which animations are chosen; and what is
// wrong with them.
#include <cmath>
#include <limits>

#include "common/scene/bundle.h"
#include "common/scene/transform.h"
#include "tests/common/scene/gltf/animation/animation_fixture.h"

namespace lightmill {
namespace {

using nlohmann::json;

class GltfPose : public AnimatedGltf {
 protected:
  /// The square turns about z by 90 degrees in 2 s.
  void turn(size_t animation = 0) {
    const float h = std::sqrt(0.5f);
    channel(node(0, "rotation"), {0, 2}, floats({0, 0, 0, 1, 0, 0, h, h}, "VEC4", 4), "LINEAR", animation);
  }
  /// It moves along x from 0 to 10 in 2 s.
  void slide(size_t animation = 0) {
    channel(node(0, "translation"), {0, 2}, floats({0, 0, 0, 10, 0, 0}, "VEC3", 3), "LINEAR", animation);
  }
  static bool mended(const LoadResult& r, const std::string& what) { return r.ok() && mentions(r, what); }
};

TEST_F(GltfPose, WithoutOptionsNodesStandAsTheFileSays) {
  document_["nodes"][0]["translation"] = {1, 2, 3};
  slide();
  expect_near(corner(clean_document(), 0), {1, 2, 3});
  expect_near(corner(clean_at(1, "none"), 0), {1, 2, 3});
  expect_near(corner(clean_at(0), 0), {0, 0, 0});
}

TEST_F(GltfPose, ATurningSquare) {
  turn();
  for (const double t : {-1.0, 0.0, 0.5, 1.0, 1.7, 2.0, 30.0}) {
    const double angle = std::clamp(t, 0.0, 2.0) * M_PI / 4, c = std::cos(angle), s = std::sin(angle);
    const SceneDescription scene = clean_at(t);
    expect_near(corner(scene, 0), {0, 0, 0});
    expect_near(corner(scene, 1), {c, s, 0});
    expect_near(corner(scene, 2), {c - s, s + c, 0});
  }
}

TEST_F(GltfPose, TranslationRotationAndScaleTogetherUnderAParent) {
  turn();
  slide();
  channel(node(0, "scale"), {0, 2}, floats({1, 1, 1, 3, 5, 1}, "VEC3", 3), "STEP");
  document_["scenes"][0]["nodes"] = {1, 2};
  document_["nodes"].push_back({{"children", {0}}, {"translation", {0, 100, 0}}});
  channel(node(2, "scale"), {0, 2}, floats({2, 2, 2, 4, 4, 4}, "VEC3", 3));
  // At 1 s the parent's scale is 3.
  const double h = std::sqrt(0.5);
  expect_near(corner(clean_at(1), 1), {3 * (5 + h), 100 + 3 * h, 0}, 1e-5);
  // At the end: x is turned to y and stretched by 3, y to -x by 5, under a scale of 4.
  expect_near(corner(clean_at(2), 2), {4 * (10 - 5), 100 + 4 * 3, 0}, 1e-5);
}

TEST_F(GltfPose, ANodeWithAMatrixIsTakenApart) {
  // A turn by 90 degrees about z and a stretch by 2 along x, at (7, 8, 9).
  document_["nodes"][0]["matrix"] = {0, 2, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1};
  slide();
  expect_near(corner(clean_at(0), 2), {-1, 2, 0});
  expect_near(corner(clean_at(1), 2), {4, 2, 0});
}

TEST_F(GltfPose, NormalisedIntegersAreDecoded) {
  const int bytes = add_accessor(raw_bytes<int8_t>({0, 0, 0, 127, 0, 0, 127, 0}), kByte, 2, "VEC4");
  document_["accessors"][static_cast<size_t>(bytes)]["normalized"] = true;
  channel(node(0, "rotation"), {0, 2}, bytes);
  expect_near(corner(clean_at(2), 1), {-1, 0, 0});
  expect_near(corner(clean_at(1), 1), {0, 1, 0});
}

TEST_F(GltfPose, ChoosesAnimations) {
  slide(0);  // "go"
  turn(1);   // moves something else
  channel(node(0, "translation"), {0, 2}, floats({0, 0, 0, 0, 50, 0}, "VEC3", 3), "LINEAR", 2);  // "up"
  document_["animations"][0]["name"] = "go";
  document_["animations"][2]["name"] = "up";
  expect_near(corner(clean_at(2), 1), {10, 1, 0});  // the first, and what is beside it
  expect_near(corner(clean_at(2, "go"), 1), {11, 0, 0});
  expect_near(corner(clean_at(2, "0"), 1), {11, 0, 0});
  expect_near(corner(clean_at(2, "1"), 1), {0, 1, 0});
  expect_near(corner(clean_at(2, "up"), 1), {1, 50, 0});
  const LoadResult all = load_document(at(2, "all"));
  EXPECT_TRUE(mended(all, "moves what another channel moves; the last one counts")) << listed(all);
  expect_near(corner(all.scene, 1), {0, 51, 0});
  const LoadResult none = load_document(at(2, "gone"));
  EXPECT_TRUE(has_error(
      none, "no animation of the scene is called \"gone\"; there are \"go\", \"1\", \"up\", or 0 to 2"));
  document_.erase("animations");
  EXPECT_TRUE(has_error(load_document(at(2, "gone")), "is called \"gone\"; there is none"));
  clean_at(2);
}

TEST_F(GltfPose, ANameMayBeCalledLikeAChoice) {
  slide();
  document_["animations"][0]["name"] = "none";
  expect_near(corner(clean_document(), 0), {0, 0, 0});
  expect_near(corner(clean_at(2, "none"), 0), {10, 0, 0});
}

TEST_F(GltfPose, PointersMoveNodesMaterialsLightsAndCameras) {
  document_["extensionsUsed"] = {"KHR_animation_pointer"};
  document_["extensions"]["KHR_lights_punctual"]["lights"] = {
      {{"type", "spot"}, {"spot", {{"outerConeAngle", 0.5}}}}};
  document_["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
  document_["materials"][0]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 1;
  const auto move = [&](const std::string& to, const std::vector<float>& values, const std::string& type,
                        int components) {
    channel(pointer(to), {0, 1}, floats(values, type, components));
  };
  move("/nodes/0/translation", {0, 0, 0, 4, 0, 0}, "VEC3", 3);
  move("/materials/0/emissiveFactor", {0, 0, 0, 1, 0.5f, 0}, "VEC3", 3);
  move("/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength", {1, 9}, "SCALAR", 1);
  move("/materials/0/pbrMetallicRoughness/baseColorFactor", {0, 0, 0, 1, 0.5f, 1, 0.25f, 1}, "VEC4", 4);
  move("/materials/0/pbrMetallicRoughness/roughnessFactor", {1, 0.5f}, "SCALAR", 1);
  move("/extensions/KHR_lights_punctual/lights/0/color", {1, 1, 1, 1, 0, 0}, "VEC3", 3);
  move("/extensions/KHR_lights_punctual/lights/0/intensity", {0, 10}, "SCALAR", 1);
  move("/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", {0.5f, 1}, "SCALAR", 1);
  move("/cameras/0/perspective/yfov", {0.8f, 1.6f}, "SCALAR", 1);
  const SceneDescription s = clean_at(0.5);
  expect_near(corner(s, 0), {2, 0, 0});
  EXPECT_EQ(s.area_lights.at(0).radiance, (Rgb{2.5f, 1.25f, 0}));
  const auto& m = std::get<MetallicRoughnessMaterial>(s.materials.at(0).kind);
  EXPECT_EQ(m.base_color.value, (Rgb{0.25f, 0.5f, 0.125f}));
  EXPECT_EQ(m.roughness.value, 0.75f);
  const auto& spot = std::get<SpotLight>(s.lights.at(0).kind);
  EXPECT_EQ(spot.intensity, (Rgb{5, 2.5f, 2.5f}));
  EXPECT_NEAR(spot.total_width, 0.75 * 180 / M_PI, 1e-5);
  EXPECT_NEAR(s.camera.fov_degrees, 1.2 * 180 / M_PI, 1e-5);
}

TEST_F(GltfPose, PointersHideNodes) {
  document_["nodes"][0]["extensions"]["KHR_node_visibility"]["visible"] = true;
  const int flags = add_accessor(raw_bytes<uint8_t>({1, 0}), kUnsignedByte, 2, "SCALAR");
  channel(pointer("/nodes/0/extensions/KHR_node_visibility/visible"), {0, 1}, flags, "STEP");
  EXPECT_EQ(clean_at(0.5).shapes.size(), 1u);
  const LoadResult r = load_document(at(1));
  EXPECT_TRUE(mended(r, "nothing is seen at this time of the animation")) << listed(r);
  EXPECT_TRUE(r.scene.shapes.empty());
}

TEST_F(GltfPose, PointersToNothing) {
  channel(pointer("/nodes/0/name"), {0, 1}, floats({0, 1}, "SCALAR", 1));
  channel(pointer("/materials/7/alphaCutoff"), {0, 1}, floats({0, 1}, "SCALAR", 1));
  channel(pointer("nodes"), {0, 1}, floats({0, 1}, "SCALAR", 1));
  channel(pointer("/nodes/0/translation"), {0, 1}, floats({0, 1}, "SCALAR", 1));
  const LoadResult r = load_document(at(1));
  EXPECT_TRUE(mended(r, "the pointer \"/nodes/0/name\" is nothing that animations can change here"));
  EXPECT_TRUE(mended(r, "the pointer \"/materials/7/alphaCutoff\" leads to nothing in the file"));
  EXPECT_TRUE(mended(r, "has 1 component(s), which does not fit")) << listed(r);
}

TEST_F(GltfPose, DamagedSamplers) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto says = [&](const std::vector<float>& times, const std::vector<float>& x, const std::string& what,
                        double expected) {
    document_["animations"] = json::array();
    std::vector<float> values;
    for (const float v : x) values.insert(values.end(), {v, 0, 0});
    channel(node(0, "translation"), times, floats(values, "VEC3", 3));
    const LoadResult r = load_document(at(1));
    EXPECT_TRUE(mended(r, what)) << listed(r);
    EXPECT_NEAR(corner(r.scene, 0).x, expected, 1e-6) << what;
    LoadOptions strict = at(1);
    strict.strict = true;
    EXPECT_FALSE(load_document(strict).ok()) << what;
  };
  says({2, 0}, {20, 0}, "has times out of order; its keys are put in order", 10);
  says({0, nan, 2}, {0, 7, 20}, "1 keys that are not finite are left out", 10);
  says({0, 1, 2}, {0, nan, 20}, "1 keys that are not finite are left out", 10);
  says({0, 2, 3}, {0, 20}, "has 3 times for values of 2 keys", 10);
  says({0, 2}, {0, 20, 30}, "has 2 times for values of 3 keys", 10);
  says({nan}, {5}, "has no key; it is left out", 0);
}

TEST_F(GltfPose, DamagedChannels) {
  slide();
  auto& a = document_["animations"][0];
  const auto says = [&](const std::string& what) {
    const LoadResult r = load_document(at(1));
    EXPECT_TRUE(mended(r, what)) << listed(r) << what;
  };
  a["samplers"][0]["interpolation"] = "BEZIER";
  says("is neither STEP, LINEAR nor CUBICSPLINE: \"BEZIER\"; LINEAR is used");
  a["samplers"][0]["output"] = 99;
  says("refers to accessor 99");
  a["samplers"][0].erase("output");
  says("needs \"output\"");
  a["channels"][0]["target"]["path"] = "shear";
  says("must be \"translation\", \"rotation\"");
  a["channels"][0]["target"] = {{"path", "translation"}, {"node", 99}};
  says("refers to node 99");
  a["channels"][0] = {{"target", node(0, "scale")}, {"sampler", 4}};
  says("refers to sampler 4");
  a["channels"][0] = 5;
  says("must be an object");
  a["channels"] = json::array();
  says("has no channels, so nothing moves by it");
  a = 7;
  says("must be an object");
  document_["animations"] = {{{"channels", {{{"target", {{"path", "scale"}}}, {"sampler", 0}}}}}};
  EXPECT_TRUE(load_document(at(1)).ok()) << "a target without a node is skipped";
}

TEST_F(GltfPose, SplinesThatOvershootColoursAreCutSilently) {
  const std::vector<float> keys = {0,  0,  0,  0,  1, 1, 1, 1, 9, 9, 9, 9,
                                   -9, -9, -9, -9, 1, 1, 1, 1, 0, 0, 0, 0};
  channel(pointer("/materials/0/pbrMetallicRoughness/baseColorFactor"), {0, 1}, floats(keys, "VEC4", 4),
          "CUBICSPLINE");
  const SceneDescription s = clean_at(0.5);
  EXPECT_EQ(std::get<MetallicRoughnessMaterial>(s.materials.at(0).kind).base_color.value, (Rgb{1, 1, 1}));
}

TEST_F(GltfPose, ScenesThatHideThingsByAScaleOfZeroAreClean) {
  document_["nodes"].push_back({{"mesh", 0}});
  document_["scenes"][0]["nodes"] = {0, 1, 2};
  channel(node(2, "scale"), {0, 1}, floats({1, 1, 1, 0, 0, 0}, "VEC3", 3));
  EXPECT_EQ(clean_at(0).instances.size(), 2u);
  EXPECT_EQ(clean_at(1).shapes.size(), 1u);
}

TEST_F(GltfPose, WithoutACameraAllTimesShowTheSamePartOfTheWorld) {
  document_.erase("cameras");
  document_["nodes"][1].erase("camera");
  document_["nodes"].push_back({{"mesh", 0}, {"translation", {0, 0, -3}}});
  document_["scenes"][0]["nodes"] = {0, 1, 2};
  slide();
  const auto view_at = [&](double time) { return load_document(at(time)).scene.camera.camera_to_world.m; };
  EXPECT_EQ(view_at(0), view_at(0.7));
  EXPECT_EQ(view_at(0), view_at(2));
  EXPECT_NE(view_at(0), load_document().scene.camera.camera_to_world.m) << "the scene as it stands";
}

TEST_F(GltfPose, AWorkerReadsTheSamePose) {
  slide();
  const Bundle bundle = bundle_from_json(bundle_to_json(make_bundle(clean_at(0.5), nullptr)));
  const LoadResult r = load_scene("scene.gltf", DirectoryFiles(folder_.path()), load_options(bundle));
  expect_near(corner(r.scene, 0), {2.5, 0, 0});
}

TEST_F(GltfPose, IsForGltfAlone) {
  folder_.write("scene.pbrt", "WorldBegin");
  LoadOptions options;
  options.pose.time = 1;
  EXPECT_TRUE(has_error(load_scene("scene.pbrt", DirectoryFiles(folder_.path()), options),
                        "--time-of, --animation and --shutter are for glTF scenes"));
}

}  // namespace
}  // namespace lightmill
