// What moves and bends while the shutter is open.
#include <cmath>

#include "common/scene/motion.h"
#include "common/scene/transform.h"
#include "tests/common/scene/gltf/animation/animation_fixture.h"

namespace lightmill {
namespace {

using nlohmann::json;

class GltfShutter : public AnimatedGltf {
 protected:
  GltfShutter() { document_["materials"][0] = json::object(); }
  void turn(float degrees, int of = 0) {
    // In eight parts, each less than half a turn.
    std::vector<float> times, values;
    for (int i = 0; i <= 8; ++i) {
      const double half = double{degrees} * i / 8 * M_PI / 360;
      times.push_back(static_cast<float>(i) / 8);
      values.insert(values.end(),
                    {0, 0, static_cast<float>(std::sin(half)), static_cast<float>(std::cos(half))});
    }
    channel(node(of, "rotation"), times, floats(values, "VEC4", 4));
  }
  void slide() { channel(node(0, "translation"), {0, 1}, floats({0, 0, 0, 4, 0, 0}, "VEC3", 3)); }
  SceneDescription clean_through(double opens, double closes) { return clean_of(through(opens, closes)); }
  /// Nothing is wrong but that there is no light.
  static SceneDescription clean_result(LoadResult r) {
    for (const Problem& p : r.problems) {
      if (p.message.find("emits light") == std::string::npos) ADD_FAILURE() << format_problem(p);
    }
    return std::move(r.scene);
  }
  SceneDescription clean_of(const LoadOptions& options) { return clean_result(load_document(options)); }
  static Way way_of(const SceneDescription& s) {
    return {s.shapes.at(0).object_to_world, s.shapes.at(0).moves_to, s};
  }
  /// Corner `vertex` at the fraction `time` of the exposure, by the steps of a mesh that bends.
  static Vec3d bent_corner(const SceneDescription& s, size_t vertex, double time) {
    const TriangleMesh& mesh = mesh_of(s);
    const auto position = [&](size_t step) {
      return step == 0 ? mesh.positions.at(vertex) : mesh.later.at(step - 1).positions.at(vertex);
    };
    const double along = time * static_cast<double>(mesh.later.size());
    const size_t step = std::min(static_cast<size_t>(along), mesh.later.size() - 1);
    const Vec3f a = position(step), b = position(step + 1);
    const double f = along - static_cast<double>(step);
    return transform_point(s.shapes.at(0).object_to_world,
                           {(1 - f) * a.x + f * b.x, (1 - f) * a.y + f * b.y, (1 - f) * a.z + f * b.z});
  }
};

TEST_F(GltfShutter, NothingMovesWithoutAShutterOrOutsideOfTheAnimation) {
  slide();
  EXPECT_EQ(clean_of(at(0.5)).shapes.at(0).moves_to, -1);
  const SceneDescription after = clean_through(2, 3);
  EXPECT_EQ(after.shapes.at(0).moves_to, -1);
  expect_near(corner(after, 0), {4, 0, 0});
}

TEST_F(GltfShutter, StraightWaysHaveTwoEnds) {
  slide();
  const SceneDescription s = clean_through(0.25, 0.75);
  EXPECT_EQ(s.later.size(), 1u);
  EXPECT_TRUE(s.between.empty());
  expect_near(corner(s, 0), {1, 0, 0});
  for (const double t : {0.0, 0.3, 1.0}) EXPECT_NEAR(way_of(s).at(t).m[0][3], 1 + 2 * t, 1e-6);
}

TEST_F(GltfShutter, TurnsOfMoreThanHalfACircleAreFollowed) {
  turn(540);
  const SceneDescription s = clean_through(0, 1);
  ASSERT_EQ(s.between.size(), 1u);
  const Way way = way_of(s);
  EXPECT_NEAR(way.degrees(), 540, 1e-3);
  for (const double t : {0.0, 0.1, 0.37, 0.5, 0.77, 1.0}) {
    const Vec3d p = transform_point(way.at(t), {1, 0, 0});
    expect_near(p, {std::cos(3 * M_PI * t), std::sin(3 * M_PI * t), 0}, 2e-3);
  }
}

TEST_F(GltfShutter, ArcsUnderATurningParentAreFollowed) {
  document_["scenes"][0]["nodes"] = {1, 2};
  document_["nodes"].push_back({{"children", {0}}});
  document_["nodes"][0]["translation"] = {10, 0, 0};
  turn(90, 2);
  const Way way = way_of(clean_through(0, 1));
  for (const double t : {0.0, 0.1, 0.37, 0.5, 0.77, 1.0}) {
    const double angle = M_PI / 2 * t;
    expect_near(transform_point(way.at(t), {}), {10 * std::cos(angle), 10 * std::sin(angle), 0}, 0.02);
  }
}

TEST_F(GltfShutter, StepsArePartOfTheWay) {
  channel(node(0, "translation"), {0, 0.5f}, floats({0, 0, 0, 4, 0, 0}, "VEC3", 3), "STEP");
  const Way way = way_of(clean_through(0, 1));
  EXPECT_NEAR(way.at(0.4).m[0][3], 0, 1e-6);
  EXPECT_NEAR(way.at(0.6).m[0][3], 4, 1e-6);
}

TEST_F(GltfShutter, InstancesMove) {
  document_["scenes"][0]["nodes"] = {0, 1, 2};
  document_["nodes"].push_back({{"mesh", 0}});
  slide();
  const SceneDescription s = clean_through(0, 1);
  ASSERT_EQ(s.instances.size(), 2u);
  EXPECT_EQ((s.instances[0].moves_to >= 0) + (s.instances[1].moves_to >= 0), 1);
}

TEST_F(GltfShutter, CamerasMove) {
  channel(node(1, "translation"), {0, 1}, floats({0, 0, 5, 3, 0, 5}, "VEC3", 3));
  const SceneDescription s = clean_through(0, 1);
  ASSERT_GE(s.camera.moves_to, 0);
  EXPECT_EQ(s.camera.camera_to_world.m[0][3], 0);
  EXPECT_EQ(s.later.at(static_cast<size_t>(s.camera.moves_to)).m[0][3], 3);
  EXPECT_TRUE(Motion(s.camera.camera_to_world, s.later[static_cast<size_t>(s.camera.moves_to)]).is_rigid());
}

TEST_F(GltfShutter, EmittersAndLightsMove) {
  document_["materials"][0] = {{"emissiveFactor", {1, 1, 1}}};
  slide();
  LoadOptions options = through(-0.25, 0.25);
  options.pose.time = 0.5;
  document_["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}}};
  document_["nodes"][0]["extensions"]["KHR_lights_punctual"]["light"] = 0;
  const SceneDescription s = clean_of(options);
  EXPECT_NEAR(way_of(s).at(0.5).m[0][3], 2, 1e-6);
  ASSERT_EQ(s.lights.at(0).later.size(), 1u);
  EXPECT_NEAR(std::get<PointLight>(s.lights[0].kind).position.x, 1, 1e-6);
  EXPECT_NEAR(std::get<PointLight>(s.lights[0].later[0]).position.x, 3, 1e-6);
}

TEST_F(GltfShutter, WhatIsFlattenedOnItsWayStands) {
  channel(node(0, "scale"), {0, 1}, floats({1, 1, 1, -1, 1, 1}, "VEC3", 3));
  const LoadResult r = load_document(through(0, 1));
  EXPECT_TRUE(r.ok() && mentions(r, "flattened or turned inside out")) << listed(r);
  EXPECT_EQ(r.scene.shapes.at(0).moves_to, -1);
}

TEST_F(GltfShutter, MorphsHaveTwoStepsAndArcsOfSkinsSeveral) {
  primitive()["targets"] = {{{"POSITION", floats({0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0}, "VEC3", 3)}}};
  channel(node(0, "weights"), {0, 1}, floats({0, 1}, "SCALAR", 1));
  const SceneDescription s = clean_through(0.25, 0.75);
  ASSERT_EQ(mesh_of(s).later.size(), 1u);
  for (const double t : {0.0, 0.3, 1.0}) expect_near(bent_corner(s, 2, t), {1, 1, 1 + 2 * t});
  EXPECT_TRUE(mesh_of(clean_through(2, 3)).later.empty()) << "nothing bends after the end";
}

TEST_F(GltfShutter, SkinsFollowTheArcsOfTheirJoints) {
  document_["scenes"][0]["nodes"] = {0, 1, 2};
  document_["nodes"].push_back({{"name", "joint"}});
  document_["skins"] = {{{"joints", {2}}}};
  document_["nodes"][0]["skin"] = 0;
  primitive()["attributes"]["JOINTS_0"] =
      add_accessor(raw_bytes(std::vector<uint8_t>(16, 0)), kUnsignedByte, 4, "VEC4");
  std::vector<float> w;
  for (int i = 0; i < 4; ++i) w.insert(w.end(), {1, 0, 0, 0});
  primitive()["attributes"]["WEIGHTS_0"] = floats(w, "VEC4", 4);
  turn(180, 2);
  const SceneDescription s = clean_through(0, 1);
  EXPECT_EQ(s.shapes.at(0).moves_to, -1);
  EXPECT_GE(mesh_of(s).later.size(), 8u);
  for (const double t : {0.0, 0.11, 0.43, 0.5, 0.9, 1.0}) {
    const double angle = M_PI * t;
    expect_near(bent_corner(s, 1, t), {std::cos(angle), std::sin(angle), 0}, 1e-3);
  }
}

TEST_F(GltfShutter, ZeroAreaIsForSomeTimeOnly) {
  // The target makes the square of what is a line at first.
  const std::string flat = raw_bytes<float>({0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0});
  primitive()["attributes"]["POSITION"] = add_accessor(flat, kFloat, 4, "VEC3");
  primitive()["targets"] = {{{"POSITION", floats({0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0}, "VEC3", 3)}}};
  channel(node(0, "weights"), {0, 1}, floats({0, 1}, "SCALAR", 1));
  EXPECT_EQ(mesh_of(clean_through(0, 1)).triangles.size(), 2u);
}

}  // namespace
}  // namespace lightmill
