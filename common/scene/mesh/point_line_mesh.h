#pragma once
// Points and lines as meshes: things without extent can't be hit by rays.
#include <array>
#include <cstdint>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// Vertices of points or lines: where they are, and what colour (empty, or one each).
struct LooseVertices {
  std::vector<Vec3f> positions;
  std::vector<std::array<float, 4>> colors;
};

/// The largest number of points, or of segments, that becomes a mesh.
inline constexpr size_t kMostLoose = size_t{1} << 20;

/// A radius that shows in a picture of all of them: a fixed share of the diagonal of their box.
float loose_radius(const LooseVertices& vertices);
/// Small spheres, which are icosahedra, or octahedra where there are many, with the normals of spheres. Takes
/// every n-th point for the least n that leaves kMostLoose. Points that are not finite are left out.
TriangleMesh spheres_at(const LooseVertices& points, float radius);
/// Thin tubes of three sides with the normals of round ones, open at their ends. Segments without length, or
/// of which an end is not finite or not there, and those after the first kMostLoose, are left out.
TriangleMesh tubes_along(const LooseVertices& vertices, const std::vector<std::array<uint32_t, 2>>& segments,
                         float radius);

}  // namespace lightmill
