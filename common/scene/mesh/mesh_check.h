#pragma once
// Validation and cleaning of triangle meshes, whatever file they came from.
#include <cstddef>

#include "common/scene/description.h"

namespace lightmill {

/// Throws Error(kBadScene) with a phrase such as "vertex 3 is not finite" or "triangle 4 refers to vertex 9,
/// but there are 5" if the mesh can't be used.
void require_valid_mesh(const TriangleMesh& mesh);
/// Puts right what a mesh can do without: normals and uvs that are not finite become 0, triangles with a
/// vertex that is not finite or not there are removed.
struct MeshRepairs {
  size_t normals = 0, uvs = 0, triangles = 0;
};
MeshRepairs mend_values(TriangleMesh* mesh);
/// Removes triangles without area; returns how many.
size_t drop_zero_area_triangles(TriangleMesh* mesh);
/// Gives vertices whose normal has no direction the area-weighted normal of their triangles;
/// returns how many.
size_t mend_zero_normals(TriangleMesh* mesh);
/// Area of the mesh under a transform.
double mesh_area(const TriangleMesh& mesh, const Transform& transform);

}  // namespace lightmill
