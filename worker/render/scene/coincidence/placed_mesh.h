#pragma once
// Meshes whose vertices are in place, and the planes of their triangles, in double.
#include <array>
#include <cstddef>
#include <cstdint>

#include "common/scene/description.h"
#include "common/scene/transform.h"

namespace lightmill {

/// A mesh whose vertices are in place.
struct PlacedMesh {
  const TriangleMesh* mesh = nullptr;  // null: not looked at
  size_t first_vertex = 0;             // of its vertices in the array of positions
  double rounding = 0;                 // of its coordinates in the file, in the space they are placed in
};

inline constexpr double kRoundoff = 0x1p-24;  // of float, relative

inline Vec3d minus(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
/// How far `a` reaches along `b`, if that is unit.
inline double along(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Corners of a triangle, in double.
using FaceCorners = std::array<Vec3d, 3>;
FaceCorners face_corners(const PlacedMesh& mesh, const float* positions, uint32_t triangle);
/// The plane of a triangle.
struct FacePlane {
  Vec3d normal;           // unit, of the winding; zero if the triangle has collapsed
  double area = 0;        // twice
  double longest = 0;     // side
  double coordinate = 0;  // largest
  explicit FacePlane(const FaceCorners& p);
};

/// How far apart points may lie whose coordinates reach `coordinate` and that were one before rounding.
inline double same_within(double coordinate, double rounding) {
  return 8 * kRoundoff * coordinate + 2 * rounding;
}

}  // namespace lightmill
