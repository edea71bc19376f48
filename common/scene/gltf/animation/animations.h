#pragma once
// The animations of a glTF file that are shown, and what they say at a time.
//
//   GltfAnimations animations(scene, buffers, root, document, pose_choice);
//   animations.pose(1.5, &document);                       // the document as it is after 1.5 s
#include <map>

#include "common/scene/gltf/accessors.h"
#include "common/scene/gltf/animation/keyframes.h"
#include "common/scene/gltf/animation/targets.h"

namespace lightmill {

class GltfAnimations {
 public:
  /// Reads those of `document`'s animations that `choice` means; nothing: none. What can't be used is left
  /// out and reported.
  GltfAnimations(GltfScene& scene, GltfBuffers& buffers, const GltfValue& root,
                 const nlohmann::json& document, const PoseChoice& choice);

  /// Puts everything that moves where it is at `time`.
  void pose(double time, nlohmann::json* document) const;
  /// Makes of the matrices of nodes that move what can be moved.
  void prepare(nlohmann::json* document) const;

  /// The value at `time` of `what` of a node: "translation", "rotation", "scale", "weights"; false if nothing
  /// moves it. `out` gets as many numbers as it has.
  bool at(size_t node, const char* what, double time, std::vector<double>* out) const;
  /// Whether something moves the node's own transform.
  bool moves(size_t node) const;
  /// Likewise the weights of a mesh, where its nodes have none of their own.
  bool weights_at(size_t mesh, double time, std::vector<double>* out) const;
  bool empty() const { return channels_.empty(); }
  /// The times of the first and the last key of all; not empty().
  std::pair<double, double> span() const;

 private:
  struct Channel {
    GltfTarget target;
    Keyframes keyframes;
  };
  std::vector<size_t> chosen(const GltfValue& root, const std::string& choice) const;
  std::vector<size_t> side_by_side(const GltfValue& root) const;
  std::string pointer_of(const GltfValue& target) const;
  void read(const GltfValue& animation, const nlohmann::json& document);
  void read_channel(const GltfValue& animation, const GltfValue& channel, const nlohmann::json& document);
  Keyframes read_sampler(const GltfValue& sampler, const GltfTarget& target);
  const Channel* channel(const std::string& pointer) const;

  GltfScene& scene_;
  GltfBuffers& buffers_;
  GltfValue root_;
  std::vector<Channel> channels_;
  std::map<std::string, size_t> by_pointer_;
};

}  // namespace lightmill
