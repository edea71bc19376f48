#pragma once
// Triangle meshes of the curved shapes that the renderer does not intersect directly. Parametrised as pbrt
// does: the winding's normal is dp/du x dp/dv, outward for spheres and cylinders, +z for disks.
#include <array>

#include "common/scene/description.h"

namespace lightmill {

/// Part of a sphere about the origin between the planes zmin and zmax (within [-radius, radius]) and the
/// angles 0 and phimax (radians, at most 2 pi); with normals and uv.
TriangleMesh sphere_mesh(double radius, double zmin, double zmax, double phimax);
/// Open cylinder about the z axis; with normals and uv.
TriangleMesh cylinder_mesh(double radius, double zmin, double zmax, double phimax);
/// Ring (or, with inner radius 0, disk) in the plane z = height; with uv, without normals.
TriangleMesh disk_mesh(double height, double radius, double inner_radius, double phimax);
/// Bilinear patch p00, p10, p01, p11: two triangles if it is flat, else a fine grid; with uv, without
/// normals.
TriangleMesh patch_mesh(const std::array<Vec3f, 4>& corners);
/// Appends `part` to `mesh`; both must have the same optional data.
void append_mesh(TriangleMesh* mesh, const TriangleMesh& part);

}  // namespace lightmill
