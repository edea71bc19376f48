// How nodes bend their meshes: the weights of morph targets, and skins.
#include <algorithm>
#include <cmath>

#include "common/scene/gltf/nodes.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

std::vector<double> weights_of(const GltfValue& owner) {
  std::vector<double> weights(owner.count("weights"));
  for (size_t i = 0; i < weights.size(); ++i) weights[i] = owner.require("weights")[i].number(-1e6, 1e6);
  return weights;
}

}  // namespace

std::optional<GltfSkin> GltfNodes::skin_of(const GltfValue& node) {
  std::optional<GltfSkin> skin;
  scene_.attempt_optional([&] {
    const int of = node.index_or_none("skin", root_.count("skins"), "skin");
    if (of < 0) return;
    skin = read_gltf_skin(scene_, buffers_, root_, static_cast<size_t>(of));
  });
  return skin;
}

std::optional<GltfBending> GltfNodes::bending(size_t index, const GltfValue& node, size_t mesh,
                                              Transform* carried) {
  const GltfExposure exposure = tree_.exposure();
  GltfBending out;
  const bool morphs = meshes_.has_targets(mesh);
  std::vector<double> own;
  if (morphs) {
    scene_.attempt_optional(
        [&] { own = weights_of(node.count("weights") > 0 ? node : root_.require("meshes")[mesh]); });
  }
  const bool of_node = morphs && node.count("weights") > 0;
  const auto weights_at = [this, own, of_node, index, mesh](double time) {
    std::vector<double> weights = own;
    if (of_node) {
      animations_.at(index, "weights", time, &weights);
    } else {
      animations_.weights_at(mesh, time, &weights);
    }
    return weights;
  };
  std::vector<double> unused;
  const bool animated = morphs && (of_node ? animations_.at(index, "weights", 0, &unused)
                                           : animations_.weights_at(mesh, 0, &unused));
  const auto skin = skin_of(node);
  out.skinned = skin.has_value();
  out.moves = animated && exposure.is_open();
  *carried = Transform{};
  if (skin) {
    buffers_.charge(16 * skin->joints.size(), node);
    Vec3d center;
    const double share = 1 / static_cast<double>(skin->joints.size());
    for (const size_t j : skin->joints) {
      const auto m = tree_.to_world(j, exposure.time).m;
      center = {center.x + share * m[0][3], center.y + share * m[1][3], center.z + share * m[2][3]};
      out.moves = out.moves || (exposure.is_open() && tree_.moves(j));
    }
    // Numbers about the joints are small wherever they are.
    if (is_in_range(translation(center))) *carried = translation(center);
  }
  const Transform inwards = inverse(*carried);
  const auto joints_at = [this, skin, inwards](double time) {
    std::vector<Transform> joints;
    for (size_t j = 0; skin && j < skin->joints.size(); ++j)
      joints.push_back(inwards * tree_.to_world(skin->joints[j], time) * skin->inverse_binds[j]);
    return joints;
  };
  out.still = {own, joints_at(exposure.time)};
  out.opens = exposure.opens;
  out.closes = exposure.closes;
  out.at_time = [weights_at, joints_at](double time) { return GltfBend{weights_at(time), joints_at(time)}; };
  const bool rests = std::all_of(own.begin(), own.end(), [](double w) { return w == 0; });
  if (!out.skinned && !animated && rests) return std::nullopt;
  return out;
}

}  // namespace lightmill
