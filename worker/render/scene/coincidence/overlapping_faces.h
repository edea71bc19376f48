#pragma once
// Pairs of triangles that lie on each other: in one plane within rounding, and over more than an edge.
//
// Runs of neighbouring triangles have a box each. Only where two boxes meet are triangles compared. Triangles
// of one mesh that are joined by vertices are no pair. What a search costs is bounded: beyond kMostWork (and
// some for every triangle) a box is compared with as many others as that allows, those that begin next to it.
#include <compare>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "worker/render/scene/coincidence/placed_mesh.h"

namespace lightmill {

struct FaceId {
  uint32_t mesh = 0, triangle = 0;
  auto operator<=>(const FaceId&) const = default;
};
struct FacePair {
  FaceId a, b;  // a < b
};

inline constexpr size_t kMostWork = size_t{1} << 24;

/// In an order of their own, whatever the number of threads (0: one per processor). `positions`: three floats
/// per vertex.
std::vector<FacePair> overlapping_faces(const std::vector<PlacedMesh>& meshes, const float* positions,
                                        int threads);

}  // namespace lightmill
