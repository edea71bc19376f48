#pragma once
// Triangle meshes of hair and other thin curves.
#include <array>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// A chain of Bezier curves of one degree that share their ends, u from 0 to 1 along all of it.
struct BezierChain {
  int degree = 3;             // 2 or 3
  std::vector<Vec3d> points;  // degree * pieces + 1
  /// pbrt's ribbons: the surface normal at the ends of the pieces (pieces + 1, unit), interpolated on great
  /// circles. Empty: a round tube.
  std::vector<Vec3d> normals;
  double width0 = 1, width1 = 1;  // diameters at u = 0 and u = 1, linear in u; not negative, not both 0

  size_t pieces() const { return (points.size() - 1) / static_cast<size_t>(degree); }
};

/// A uniform B-spline of degree 2 or 3 (at least degree + 1 points) as Bezier curves.
BezierChain from_bspline(int degree, const std::vector<Vec3d>& points);

/// The chain as an open tube or a ribbon, with normals and uv (u along, v around or across).
///
/// Along: chords turn by at most 15 degrees on average over a piece, and are nearer to the curve than an
/// eighth of the width or a thousandth of the length, whichever is more (at most 128 to a piece). Around: an
/// odd polygon whose mean width is that of the circle, so that its silhouette's width is within 3.4 % where
/// the curve is longer than 100 widths, else 1.1 %, below 20 widths 0.3 %. Normals are the exact ones. A
/// curve without length gives no triangles.
TriangleMesh curve_mesh(const BezierChain& chain);

}  // namespace lightmill
