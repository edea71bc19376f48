#pragma once
// Triangle meshes of the curved shapes that the renderer does not intersect directly. Parametrised as pbrt
// does: the winding's normal is dp/du x dp/dv, outward for spheres and cylinders, +z for disks.
//
// Fine enough that no picture tells them from the shapes: each has its shape's area, so that emitters have
// their power, and lies within a stated part of the radius of it, with the exact normals at its vertices.
#include <array>

#include "common/scene/description.h"

namespace lightmill {

/// Segments of a full turn of a sphere unless there are very many.
inline constexpr int kSphereSegments = 256;

/// Part of a sphere about the origin between the planes zmin and zmax (within [-radius, radius]) and the
/// angles 0 and phimax (radians, at most 2 pi); with normals and uv. Within 7 / segments^2 of the radius:
/// 1e-4 of it with the default.
TriangleMesh sphere_mesh(double radius, double zmin, double zmax, double phimax,
                         int segments = kSphereSegments);
/// Open cylinder about the z axis; with normals and uv. Within 5e-6 of the radius.
TriangleMesh cylinder_mesh(double radius, double zmin, double zmax, double phimax);
/// Ring (or, with inner radius 0, disk) in the plane z = height; with uv, without normals. Within 5e-6 of
/// the radius.
TriangleMesh disk_mesh(double height, double radius, double inner_radius, double phimax);

/// Bilinear patch with corners p00, p10, p01, p11, and what is given at them in the same order.
struct BilinearPatch {
  std::array<Vec3f, 4> corners;
  std::array<Vec2f, 4> uvs{{{0, 0}, {1, 0}, {0, 1}, {1, 1}}};
  const std::array<Vec3f, 4>* normals = nullptr;  // null: those of the surface
};
/// Rows and columns that keep triangles within 1e-4 of the patch's size, and points of the surface within
/// 1e-2 of it along the surface, so that textures fit: 1 for a parallelogram, at most 64.
int patch_segments(const BilinearPatch& patch);
/// The patch in `patch_segments` rows and columns, with uv, and with normals if asked for.
TriangleMesh patch_mesh(const BilinearPatch& patch, bool with_normals);
/// Appends `part` to `mesh`; both must have the same optional data.
void append_mesh(TriangleMesh* mesh, const TriangleMesh& part);

}  // namespace lightmill
