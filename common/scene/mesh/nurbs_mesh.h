#pragma once
// Meshes of non-uniform rational B-spline surfaces, which pbrt-v3 has and v4 has not.
#include <array>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// One of a surface's two directions.
struct NurbsDirection {
  int points = 0, order = 0;  // control points; the degree + 1, within [2, points]
  std::vector<double> knots;  // points + order numbers that never decrease
  double begin = 0, end = 1;  // the part that is shown; within knots[order - 1] and knots[points]

  /// Whether points, order and knots are as said.
  bool has_knots() const;
};

/// The surface with the control points x w, y w, z w, w, row by row of u; with normals dp/du x dp/dv, and uv
/// as pbrt has them: the parameters. 8 segments a span, at least 32 and at most 256. Points where the weight
/// vanishes are not finite.
TriangleMesh nurbs_mesh(const NurbsDirection& u, const NurbsDirection& v,
                        const std::vector<std::array<double, 4>>& control_points);

}  // namespace lightmill
