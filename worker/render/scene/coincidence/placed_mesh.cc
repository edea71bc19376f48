#include "worker/render/scene/coincidence/placed_mesh.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

FaceCorners face_corners(const PlacedMesh& mesh, const float* positions, uint32_t triangle) {
  FaceCorners p;
  for (size_t k = 0; k < 3; ++k) {
    const float* v = positions + 3 * (mesh.first_vertex + mesh.mesh->triangles[triangle][k]);
    p[k] = {double{v[0]}, double{v[1]}, double{v[2]}};
  }
  return p;
}

FacePlane::FacePlane(const FaceCorners& p) {
  const Vec3d a = minus(p[1], p[0]), b = minus(p[2], p[0]), c = minus(p[2], p[1]);
  const Vec3d n = cross(a, b);
  area = std::sqrt(along(n, n));
  if (area > 0) normal = {n.x / area, n.y / area, n.z / area};
  longest = std::sqrt(std::max({along(a, a), along(b, b), along(c, c)}));
  for (const Vec3d& q : p)
    coordinate = std::max({coordinate, std::fabs(q.x), std::fabs(q.y), std::fabs(q.z)});
}

}  // namespace lightmill
