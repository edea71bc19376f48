#pragma once
// Surfaces that coincide: media that share a face, a decal on a wall, a shape listed twice.
//
// A ray that leaves a surface begins so far from it (ray_offset.h) that it would miss another surface in the
// same place; and which of the two it meets is up to rounding. So before anything is made of the vertices,
// the corners of such faces are moved along their normals: as little as rays can tell apart, and so that they
// are crossed in the order of crossing_order.h. The largest body stays. Corners that are shared move with
// them, so that bodies stay closed; shading normals stay. What is the same in all respects, down to the bits
// of its corners, is left out but once. Of two opaque bodies that touch no ray sees the faces: they stay.
//
// How far: let e = gamma_7 c bound the error of a hit, c being the largest coordinate. The offset is up to
// sqrt(3) e along the normal, on either side of a point that is itself off by as much, and the next ray's
// distance to the other face is rounded by about e. That and the rounding of corners adds up to less than 5 e
// = 35 roundoffs of c for one face, and a ray that comes back needs as much: 64 c are taken.
//
// Not dealt with are faces that share their vertices (a mesh that lists a triangle twice), meshes of more
// than 4096 triangles without shared vertices against themselves, hair, triangles of a height of few
// roundoffs, and faces of instances (instancing.h) against other instances or the world; faces within an
// instanced object are. Stacks of more than 32 bodies are not spread beyond that.
#include <string>
#include <vector>

#include "worker/render/scene/coincidence/overlapping_faces.h"
#include "worker/render/scene/coincidence/surface_traits.h"

namespace lightmill {

/// How far apart surfaces come to lie, over their largest coordinate, and over the error of a hit.
inline constexpr double kSetApart = 64 * kRoundoff, kSetApartOverError = 64.0 / 7;

/// The space that shapes lie in.
struct CoincidenceSpace {
  bool has_viewer = true;  // at the origin
  double more = 0;         // to be set apart by, as rays are rounded on their way into the space
  int threads = 0;         // 0: one per processor
};

struct CoincidentFaces {
  std::vector<FaceId> left_out;  // ascending
  size_t faces = 0;              // that lie on others
  double moved = 0;              // how far at most
  std::vector<SourceLocation> shapes;
};

/// Moves vertices of `meshes` in `positions` (three floats per vertex). `normals`: as many, towards the
/// outside, or null.
CoincidentFaces separate_faces(const std::vector<PlacedMesh>& meshes,
                               const std::vector<SurfaceTraits>& traits, const float* normals,
                               const CoincidenceSpace& space, float* positions);

/// A sentence about surfaces of `shapes`, of which there are some. The first one's place is said elsewhere.
std::string describe_coincidence(size_t faces, size_t spheres, const std::vector<SourceLocation>& shapes);

}  // namespace lightmill
