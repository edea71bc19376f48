#pragma once
// Camera vertices joined to lights through glass and off mirrors (manifold_walk.h), where camera paths alone
// could bring that light: no light path ends where they come from. They would have to meet the light, which
// they never do if it is at a point, and seldom if it is small.
//
// A camera path that does meet it, by a way that the walks find, counts for nothing; by any other it counts
// as ever. Which ways are found is a function of the vertex and the point of the light, so that each way is
// counted once: no density of the walks is asked for.
#include <vector>

#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/path_vertex.h"

namespace lightmill {

/// What a wavefront needs for it.
struct ManifoldWork {
  Wavefront chains;
  std::vector<int32_t> joined;           // indices of vertices
  std::array<float, kWavefront> chance;  // of each vertex that it was to be joined
  LaneInt rays{};                        // that the last walks took
  // Per camera path: its last vertex that was joined, if it has met nothing but mirrors and smooth glass
  // since, and the direction in which it has left.
  std::array<Vertex, kWavefront> vertex;
  std::array<Vec3<float>, kWavefront> direction;
  std::array<bool, kWavefront> waits{};
};

/// Begins a pass.
void begin_manifolds(const StageContext& context, Wavefront& w);

/// Adds what comes to the vertices of wavefront.vertices at `depth`, whose paths have gone on.
void connect_manifolds(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w);

/// Which of the camera paths in slots `slot` that meet light `light` at `at` (a point or, of those at
/// infinity, a unit direction), at their vertex of `depth`, have come there by a way that is counted already.
LaneMask counted_by_manifolds(const StageContext& context, LaneInt slot, LaneMask meets, LaneInt light,
                              const Vec3<Lane>& at, LaneMask infinite, int depth, Wavefront& w);

}  // namespace lightmill
