#pragma once
// Meshes of the surfaces of revolution that pbrt-v3 has and v4 has not: cone, paraboloid, hyperboloid.
#include <functional>

#include "common/scene/description.h"

namespace lightmill {

/// What the curve `profile`, over [0, 1], sweeps when it turns about the z axis by angles from 0 to phimax
/// (radians, at most 2 pi); with normals and uv, parametrised as pbrt does: u by angle, v along the curve.
/// 256 segments of a full turn, 64 along.
TriangleMesh revolution_mesh(const std::function<Vec3d(double v)>& profile, double phimax);

/// pbrt-v3's height field: nu x nv heights over the unit square, row by row.
TriangleMesh height_field_mesh(int nu, int nv, const std::vector<double>& heights);

}  // namespace lightmill
