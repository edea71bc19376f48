#pragma once
// Moves the corners of meshes off planes that they lie in.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "worker/render/scene/coincidence/mesh_bodies.h"

namespace lightmill {

/// A corner is to lie `by` along `normal`, which is unit, from where it is.
struct CornerWish {
  uint32_t mesh = 0, corner = 0;
  size_t plane = 0;  // of the wishes for one plane the longest counts
  Vec3d normal;
  double by = 0;
};

/// Does so for all vertices at these corners. Where a corner has several wishes, they are met in turn until
/// none is left (Kaczmarz 1937): exactly if there are up to three, and at least as far as wished if a curved
/// surface has more. Returns how far the farthest goes.
double move_corners(std::vector<CornerWish> wishes, const std::vector<PlacedMesh>& meshes,
                    const std::vector<std::optional<MeshBodies>>& bodies, float* positions);

}  // namespace lightmill
