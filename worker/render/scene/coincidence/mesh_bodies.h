#pragma once
// The bodies of a mesh: its parts that share corners.
//
// Vertices in one place are one corner, whose normals or texture coordinates differ. Not so where bodies of
// one mesh touch: there parts belong together that share vertices, or an edge that is nobody else's.
#include <cstdint>
#include <vector>

#include "worker/render/scene/coincidence/groups.h"
#include "worker/render/scene/coincidence/placed_mesh.h"

namespace lightmill {

struct Body {
  double size = 0;           // of its box, of which some bits are kept: copies have one size
  double lo[3], hi[3];       // its box
  bool flat = false;         // it lies in one plane
  int winding_outwards = 0;  // 1: normals of the winding point out of it, -1: into it, 0: it encloses nothing
};

class MeshBodies {
 public:
  /// `touch`: whether some do.
  MeshBodies(const PlacedMesh& mesh, const float* positions, bool touch);

  /// The first vertex of the same body that lies where `vertex` does.
  uint32_t corner(uint32_t vertex) const { return corner_[vertex]; }
  uint32_t body_of(uint32_t triangle) const { return body_of_vertex_[triangles_[triangle][0]]; }
  const Body& body(uint32_t index) const { return bodies_[index]; }
  uint32_t vertex_count() const { return static_cast<uint32_t>(corner_.size()); }

 private:
  void join_parts(bool touch);
  void split_corners();
  void measure(const PlacedMesh& mesh, const float* positions);

  const std::vector<std::array<uint32_t, 3>>& triangles_;
  std::vector<uint32_t> corner_, body_of_vertex_;
  std::vector<Body> bodies_;
};

}  // namespace lightmill
