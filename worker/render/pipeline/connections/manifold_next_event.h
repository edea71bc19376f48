#pragma once
// Manifold next-event estimation: camera vertices are joined to lights through glass and off mirrors
// (manifold_walk.h), where camera paths alone could bring that light. No light path ends where they come
// from. They would have to hit the light, which they never do if it is at a point, and seldom if it is small.
//
// A camera path that does hit it counts for nothing if it came a way that the walks find, and counts as usual
// otherwise. Which ways are found is a function of the vertex and the point of the light, so each way is
// counted once and no density of the walks is needed.
#include <vector>

#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/paths/path_vertex.h"

namespace lightmill {

/// What a wavefront needs for manifold next-event estimation.
struct ManifoldWork {
  Wavefront chains;
  std::vector<int32_t> joined;           // indices of vertices
  std::array<float, kWavefront> chance;  // probability of each vertex that it was joined
  LaneInt rays{};                        // number of those that the last walks took
  // Per camera path: its last vertex that was joined, if it has met nothing but mirrors and smooth glass
  // since, and the direction in which it has left.
  std::array<Vertex, kWavefront> vertex;
  std::array<Vec3<float>, kWavefront> direction;
  std::array<bool, kWavefront> waits{};
};

/// Begins a pass.
void begin_manifolds(const StageContext& context, Wavefront& w);

/// Adds the light that walks bring to the vertices of wavefront.vertices at `depth`, whose paths have gone
/// on.
void connect_manifolds(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w);

/// Some camera paths, in slots `slot`, hit light `light` at `at` (a point; for lights at infinity a unit
/// direction), at their vertex of `depth`. Returns the lanes whose way is counted by walks already.
LaneMask counted_by_manifolds(const StageContext& context, LaneInt slot, LaneMask meets, LaneInt light,
                              const Vec3<Lane>& at, LaneMask infinite, int depth, Wavefront& w);

}  // namespace lightmill
