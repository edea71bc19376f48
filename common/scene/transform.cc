#include "common/scene/transform.h"

#include <cmath>
#include <numbers>

namespace lightmill {
namespace {

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3d minus(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec3d normalized(const Vec3d& v) {
  const double n = length(v);
  return {v.x / n, v.y / n, v.z / n};
}

}  // namespace

Vec3d cross(const Vec3d& a, const Vec3d& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
double length(const Vec3d& v) { return std::hypot(v.x, v.y, v.z); }

Transform operator*(const Transform& a, const Transform& b) {
  Transform out;
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      out.m[i][j] =
          a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j] + a.m[i][3] * b.m[3][j];
    }
  }
  return out;
}

Transform translation(const Vec3d& by) {
  Transform t;
  t.m[0][3] = by.x;
  t.m[1][3] = by.y;
  t.m[2][3] = by.z;
  return t;
}

Transform scaling(const Vec3d& by) {
  Transform t;
  t.m[0][0] = by.x;
  t.m[1][1] = by.y;
  t.m[2][2] = by.z;
  return t;
}

Transform rotation(double degrees, const Vec3d& axis) {
  const double radians = degrees * std::numbers::pi / 180;
  const double s = std::sin(radians), c = std::cos(radians);
  const Vec3d a = normalized(axis);
  const std::array<double, 3> u{a.x, a.y, a.z};
  const double skew[3][3] = {{0, -a.z, a.y}, {a.z, 0, -a.x}, {-a.y, a.x, 0}};
  Transform t;  // Rodrigues: c I + s [a]x + (1 - c) a a^T
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      t.m[i][j] = (i == j ? c : 0) + s * skew[i][j] + (1 - c) * u[i] * u[j];
    }
  }
  return t;
}

bool look_at_is_degenerate(const Vec3d& eye, const Vec3d& target, const Vec3d& up) {
  const Vec3d view = minus(target, eye);
  const double scale = length(view) * length(up);
  return !(scale > 0) || !(length(cross(up, view)) > 1e-9 * scale);
}

Transform look_at(const Vec3d& eye, const Vec3d& target, const Vec3d& up) {
  const Vec3d z = normalized(minus(target, eye));
  const Vec3d x = normalized(cross(normalized(up), z));
  const Vec3d y = cross(z, x);
  Transform t;
  t.m[0] = {x.x, x.y, x.z, -dot(x, eye)};
  t.m[1] = {y.x, y.y, y.z, -dot(y, eye)};
  t.m[2] = {z.x, z.y, z.z, -dot(z, eye)};
  return t;
}

Transform from_columns(const std::array<double, 16>& numbers) {
  Transform t;
  for (size_t i = 0; i < 16; ++i) t.m[i % 4][i / 4] = numbers[i];
  return t;
}

double determinant3(const Transform& t) {
  const auto& m = t.m;
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
         m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

Transform inverse(const Transform& t) {
  const auto& m = t.m;
  const double scale = 1 / determinant3(t);
  Transform out;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      // Cyclic indices give the cofactor its sign.
      const size_t r0 = (j + 1) % 3, r1 = (j + 2) % 3, c0 = (i + 1) % 3, c1 = (i + 2) % 3;
      out.m[i][j] = scale * (m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0]);
    }
  }
  for (size_t i = 0; i < 3; ++i) {
    out.m[i][3] = -(out.m[i][0] * m[0][3] + out.m[i][1] * m[1][3] + out.m[i][2] * m[2][3]);
  }
  return out;
}

bool is_in_range(const Transform& t) {
  for (const auto& row : t.m) {
    for (double x : row) {
      if (!(std::abs(x) <= kLargestEntry)) return false;
    }
  }
  return true;
}

bool is_affine(const Transform& t) {
  return t.m[3][0] == 0 && t.m[3][1] == 0 && t.m[3][2] == 0 && t.m[3][3] == 1;
}

bool is_singular(const Transform& t) {
  // Rows are normalised first, so that no product leaves double's range.
  Transform unit;
  for (size_t i = 0; i < 3; ++i) {
    const double n = std::hypot(t.m[i][0], t.m[i][1], t.m[i][2]);
    for (size_t j = 0; j < 3; ++j) unit.m[i][j] = t.m[i][j] / n;
  }
  return !(std::abs(determinant3(unit)) > 1e-12);
}

bool is_similarity(const Transform& t) {
  constexpr double kTolerance = 1e-4;
  const auto column = [&](size_t j) { return Vec3d{t.m[0][j], t.m[1][j], t.m[2][j]}; };
  const double scale = length(column(0));
  for (size_t j = 0; j < 3; ++j) {
    const Vec3d a = column(j), b = column((j + 1) % 3);
    const double skew = dot({a.x / scale, a.y / scale, a.z / scale}, {b.x / scale, b.y / scale, b.z / scale});
    if (!(std::abs(length(a) / scale - 1) <= kTolerance && std::abs(skew) <= kTolerance)) return false;
  }
  return true;
}

Vec3d transform_point(const Transform& t, const Vec3d& p) {
  const Vec3d v = transform_vector(t, p);
  return {v.x + t.m[0][3], v.y + t.m[1][3], v.z + t.m[2][3]};
}

Vec3d transform_vector(const Transform& t, const Vec3d& v) {
  const auto row = [&](size_t i) { return t.m[i][0] * v.x + t.m[i][1] * v.y + t.m[i][2] * v.z; };
  return {row(0), row(1), row(2)};
}

}  // namespace lightmill
