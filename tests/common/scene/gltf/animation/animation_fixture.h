#pragma once
// Documents with animations, skins and morph targets, put together from the square of gltf_fixture.h.
#include "tests/common/scene/gltf/gltf_fixture.h"

namespace lightmill {

class AnimatedGltf : public GltfTest {
 protected:
  static constexpr int kFloat = 5126, kUnsignedByte = 5121, kUnsignedShort = 5123, kByte = 5120;

  int floats(const std::vector<float>& values, const std::string& type, int components) {
    return add_accessor(raw_bytes(values), kFloat, static_cast<int>(values.size()) / components, type);
  }
  /// A channel of animation `animation` (made if it is the next one) of `output` at `times`.
  nlohmann::json& channel(const nlohmann::json& target, const std::vector<float>& times, int output,
                          const std::string& interpolation = "LINEAR", size_t animation = 0) {
    auto& animations = document_["animations"];
    if (animations.size() <= animation) animations.push_back({{"channels", nlohmann::json::array()}});
    auto& a = animations[animation];
    a["samplers"].push_back(
        {{"input", floats(times, "SCALAR", 1)}, {"output", output}, {"interpolation", interpolation}});
    a["channels"].push_back({{"sampler", a["samplers"].size() - 1}, {"target", target}});
    return a;
  }
  static nlohmann::json node(int index, const std::string& path) { return {{"node", index}, {"path", path}}; }
  static nlohmann::json pointer(const std::string& to) {
    return {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", to}}}}}};
  }
  static LoadOptions at(double time, const std::string& animation = "") {
    LoadOptions options;
    options.pose.time = time;
    options.pose.animation = animation;
    return options;
  }
  static LoadOptions through(double opens, double closes) {
    LoadOptions options;
    options.pose.time = 0;
    options.pose.opens = opens;
    options.pose.closes = closes;
    return options;
  }
  SceneDescription clean_at(double time, const std::string& animation = "") {
    return clean(load_document(at(time, animation)));
  }
  /// Where the scene shows corner `vertex` of its shape.
  static Vec3d corner(const SceneDescription& scene, size_t vertex, size_t shape = 0) {
    const Vec3f& p = mesh_of(scene, shape).positions.at(vertex);
    return transform_point(scene.shapes.at(shape).object_to_world, {p.x, p.y, p.z});
  }
  static void expect_near(const Vec3d& p, const Vec3d& q, double error = 1e-6) {
    EXPECT_NEAR(p.x, q.x, error);
    EXPECT_NEAR(p.y, q.y, error);
    EXPECT_NEAR(p.z, q.z, error);
  }
};

}  // namespace lightmill
