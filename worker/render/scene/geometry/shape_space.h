#pragma once
// Where shapes lie, in double, before and after normalisation.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/base/error.h"
#include "common/scene/description.h"
#include "worker/render/scene/lights/light_builder.h"

namespace lightmill {

using Matrix = std::array<std::array<double, 4>, 4>;

inline Vec3d transform_point(const Matrix& m, double x, double y, double z) {
  const double w = m[3][0] * x + m[3][1] * y + m[3][2] * z + m[3][3];
  const double s = w == 1 ? 1 : 1 / w;
  return {(m[0][0] * x + m[0][1] * y + m[0][2] * z + m[0][3]) * s,
          (m[1][0] * x + m[1][1] * y + m[1][2] * z + m[1][3]) * s,
          (m[2][0] * x + m[2][1] * y + m[2][2] * z + m[2][3]) * s};
}

/// Normals transform by the inverse transpose. The cofactor matrix does that up to |det|, without a division.
inline Vec3d transform_normal(const Matrix& m, double x, double y, double z) {
  const auto c = [&](int i, int j) {
    const int a = (i + 1) % 3, b = (i + 2) % 3, p = (j + 1) % 3, q = (j + 2) % 3;
    const auto u = [](int k) { return static_cast<size_t>(k); };
    return m[u(a)][u(p)] * m[u(b)][u(q)] - m[u(a)][u(q)] * m[u(b)][u(p)];
  };
  const double det = m[0][0] * c(0, 0) + m[0][1] * c(0, 1) + m[0][2] * c(0, 2);
  const double s = det < 0 ? -1 : 1;
  return {s * (c(0, 0) * x + c(0, 1) * y + c(0, 2) * z), s * (c(1, 0) * x + c(1, 1) * y + c(1, 2) * z),
          s * (c(2, 0) * x + c(2, 1) * y + c(2, 2) * z)};
}

/// The uniform scale of a transform, or nothing if it is not a similarity (relative tolerance 1e-4).
inline std::optional<double> uniform_scale(const Matrix& m) {
  double length[3];
  for (size_t j = 0; j < 3; ++j) {
    length[j] = std::sqrt(m[0][j] * m[0][j] + m[1][j] * m[1][j] + m[2][j] * m[2][j]);
  }
  const double s = length[0];
  if (!(s > 0)) return std::nullopt;
  for (size_t j = 0; j < 3; ++j) {
    const size_t k = (j + 1) % 3;
    const double d = m[0][j] * m[0][k] + m[1][j] * m[1][k] + m[2][j] * m[2][k];
    if (std::fabs(length[j] / s - 1) > 1e-4 || std::fabs(d) > 1e-4 * s * s) return std::nullopt;
  }
  return s;
}

/// The scale of a sphere's transform. Throws Error(kBadScene) with its place if it would not stay a sphere.
inline double sphere_scale(const ShapeDescription& s) {
  if (const auto scale = uniform_scale(s.object_to_world.m)) return *scale;
  throw Error(ErrorKind::kBadScene,
              place(s.location) + "a sphere under a non-uniform scale is not supported yet; use a mesh");
}

/// The space that geometry is kept in: p -> (p - origin) 2^exponent.
struct ShapeSpace {
  Vec3d origin;
  int exponent = 0;
  Vec3d relative(const Vec3d& p) const {
    return {std::ldexp(p.x - origin.x, exponent), std::ldexp(p.y - origin.y, exponent),
            std::ldexp(p.z - origin.z, exponent)};
  }
};

/// How much float rounds a mesh's coordinates in its file by, in `space`.
inline double file_rounding(const ShapeDescription& s, const ShapeSpace& space) {
  const auto* shape = std::get_if<MeshShape>(&s.kind);
  if (!shape) return 0;
  double most[3] = {0, 0, 0};
  for (const Vec3f& p : shape->mesh->positions) {
    most[0] = std::max(most[0], std::fabs(double{p.x}));
    most[1] = std::max(most[1], std::fabs(double{p.y}));
    most[2] = std::max(most[2], std::fabs(double{p.z}));
  }
  double rounding = 0;
  for (size_t i = 0; i < 3; ++i) {
    double sum = 0;
    for (size_t j = 0; j < 3; ++j) sum += std::fabs(s.object_to_world.m[i][j]) * most[j];
    rounding = std::max(rounding, std::ldexp(0x1p-24 * sum, space.exponent));
  }
  return rounding;
}

}  // namespace lightmill
