#pragma once
// Loop subdivision surfaces of triangle control meshes (Loop, "Smooth Subdivision Surfaces Based on
// Triangles", 1987), with Warren's vertex weights, as pbrt has them, and boundaries that are cubic B-splines.
#include "common/scene/description.h"

namespace lightmill {

/// Most triangles that one subdivided surface may have.
inline constexpr size_t kMaxSubdividedTriangles = size_t{1} << 22;

/// Triangles that `control` has after so many levels. Throws Error(kBadScene) with a phrase if they are more
/// than kMaxSubdividedTriangles.
size_t subdivided_count(const TriangleMesh& control, int levels);

/// Splits every triangle of `control` into 4^levels and moves the vertices to the limit surface, with the
/// limit's normals; positions and triangles of `control` are read, all finite and in range. Vertices of no
/// triangle stay where they are in the order, unused.
///
/// As in pbrt, the outside is where the control triangles are wound clockwise; the triangles returned are
/// wound anticlockwise about their normals.
///
/// Throws Error(kBadScene) with a phrase such as "has an edge from vertex 1 to vertex 2 with more than two
/// triangles" if the control mesh is not a manifold of one orientation (with or without boundary), and as
/// subdivided_count does.
TriangleMesh loop_subdivide(const TriangleMesh& control, int levels);

}  // namespace lightmill
