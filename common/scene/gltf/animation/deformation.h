#pragma once
// What bends a mesh: morph targets, which add to its vertices, and a skin, whose joints carry them along.
#include <functional>
#include <span>

#include "common/scene/gltf/accessors.h"

namespace lightmill {

/// How a mesh is bent at one time.
struct GltfBend {
  std::vector<double> weights;  // of its morph targets; missing ones are 0
  /// From the mesh's space to the shape's by each joint, its inverse bind matrix included; empty: no skin.
  std::vector<Transform> joints;
};
/// How a mesh bends.
struct GltfBending {
  bool skinned = false;
  bool moves = false;  // while the shutter is open, which it is from `opens` to `closes`
  double opens = 0, closes = 0;
  GltfBend still;  // at the picture's time
  std::function<GltfBend(double time)> at_time;

  /// At the fraction s of the time that the shutter is open.
  GltfBend at(double s) const { return at_time(opens + s * (closes - opens)); }
  /// As it is at `time`, and not moving.
  GltfBending still_at(double time) const {
    GltfBending out = *this;
    out.moves = false;
    out.still = at_time(time);
    return out;
  }
};

/// The vertices of one primitive, to be bent.
class GltfDeformer {
 public:
  using Attribute =
      std::function<std::optional<GltfAccessor>(const std::string& name, std::initializer_list<int>)>;

  /// `used`: the primitive's vertices that are wanted. `attribute` finds attributes that the picture can do
  /// without.
  GltfDeformer(GltfScene& scene, GltfBuffers& buffers, const GltfValue& root, const GltfValue& primitive,
               std::span<const uint32_t> used, const Attribute& attribute, size_t vertices, size_t joints);

  /// Whether joints carry the primitive; otherwise only morph targets bend it.
  bool skinned() const { return !influences_.empty(); }
  bool morphs() const { return !targets_.empty(); }
  /// The vertices of `rest` as `bend` has them. Normals stay unit vectors, or 0.
  MeshStep bent(const MeshStep& rest, const GltfBend& bend) const;

 private:
  struct Target {
    std::optional<GltfAccessor> positions, normals;
  };
  struct Influence {
    uint32_t joint;
    float weight;
  };
  void read_targets(GltfBuffers& buffers, const GltfValue& root, const GltfValue& primitive, size_t vertices);
  void read_influences(GltfBuffers& buffers, const GltfValue& primitive, const Attribute& attribute,
                       size_t joints);
  void morph(const GltfBend& bend, size_t i, double position[3], double normal[3]) const;
  void carry(const GltfBend& bend, size_t i, double position[3], double normal[3]) const;

  GltfScene& scene_;
  std::vector<uint32_t> used_;
  std::vector<Target> targets_;
  size_t per_vertex_ = 0;
  std::vector<Influence> influences_;  // per_vertex_ of each used vertex
};

/// The joints' inverse bind matrices of skin `index`. Throws GltfProblem if there is no such skin.
struct GltfSkin {
  std::vector<size_t> joints;            // nodes
  std::vector<Transform> inverse_binds;  // of each
};
GltfSkin read_gltf_skin(GltfScene& scene, GltfBuffers& buffers, const GltfValue& root, size_t index);

}  // namespace lightmill
