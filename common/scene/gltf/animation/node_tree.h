#pragma once
// Where the nodes of a glTF file are, at any time: those that animations move, and those that hang from them.
#include <unordered_map>

#include "common/scene/gltf/animation/animations.h"

namespace lightmill {

/// Of a quaternion (x, y, z, w), at `where`: what is no rotation, or of a length other than 1, is mended.
Transform rotation_at(const GltfValue& where, const double* q);

/// The times that a picture shows, in seconds: one, or what happens while the shutter is open.
struct GltfExposure {
  double time = 0;               // what does not blur is as it is now
  double opens = 0, closes = 0;  // opens == closes: the same as `time`

  bool is_open() const { return opens < closes; }
  double at(double s) const { return opens + s * (closes - opens); }
};

class GltfNodeTree {
 public:
  /// `root` is the document in the pose of exposure.time.
  GltfNodeTree(GltfScene& scene, const GltfValue& root, const GltfAnimations& animations,
               const GltfExposure& exposure);

  const GltfExposure& exposure() const { return exposure_; }
  /// The node's own transform in the pose of the document.
  Transform local(const GltfValue& node) const;
  /// Of node `node` at `time`.
  Transform to_world(size_t node, double time);
  /// Whether it, or what it hangs from, is moved by something while the shutter is open.
  bool moves(size_t node) const { return moves_[node]; }
  /// The node's way while the shutter is open: transforms at even times, as many as keep what is between
  /// within a thousandth of the way. A power of two and one.
  std::vector<Transform> way(size_t node);

 private:
  Transform local_at(size_t node, double time) const;
  void find_parents();

  GltfScene& scene_;
  GltfValue root_;
  const GltfAnimations& animations_;
  GltfExposure exposure_;
  std::vector<int> parent_;  // -1: none
  std::vector<bool> moves_;
  std::unordered_map<double, std::unordered_map<size_t, Transform>> worlds_;  // by time, as far as kept
  size_t kept_ = 0;
};

}  // namespace lightmill
