#include "common/scene/tessellate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/mesh_check.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kAroundSegments = 256;  // a full turn: the inscribed polygon lacks 1e-4 of a circle's area
constexpr int kPolarSegments = 128;
constexpr int kPatchSegments = 16;

struct Point {
  Vec3d p, n;
};

/// Grid of nu x nv quads over (u, v) in [0,1]^2; `point(i, j)` gives position and normal.
template <class F>
TriangleMesh grid(int nu, int nv, bool with_normals, const F& point) {
  TriangleMesh mesh;
  const auto f = [](const Vec3d& v) {
    return Vec3f{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
  };
  for (int j = 0; j <= nv; ++j) {
    for (int i = 0; i <= nu; ++i) {
      const Point at = point(i, j);
      mesh.positions.push_back(f(at.p));
      if (with_normals) mesh.normals.push_back(f(at.n));
      mesh.uvs.push_back(
          {static_cast<float>(i) / static_cast<float>(nu), static_cast<float>(j) / static_cast<float>(nv)});
    }
  }
  const auto index = [&](int i, int j) { return static_cast<uint32_t>(j * (nu + 1) + i); };
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  }
  drop_zero_area_triangles(&mesh);  // at poles and centres
  return mesh;
}

/// Segments for an arc, and the angle of its i-th end; a full turn closes exactly.
struct Arc {
  explicit Arc(double phimax)
      : phi(std::min(phimax, kTurn)),
        segments(std::max(3, static_cast<int>(std::ceil(kAroundSegments * phi / kTurn)))) {}
  Vec3d direction(int i) const {
    const double angle = i == segments && phi == kTurn ? 0 : phi * i / segments;
    return {std::cos(angle), std::sin(angle), 0};
  }
  double phi;
  int segments;
};

}  // namespace

TriangleMesh sphere_mesh(double radius, double zmin, double zmax, double phimax) {
  const Arc arc(phimax);
  const double first = std::acos(std::clamp(zmin / radius, -1.0, 1.0));
  const double last = std::acos(std::clamp(zmax / radius, -1.0, 1.0));
  const auto point = [&](int i, int j) {
    const double theta = first + (last - first) * j / kPolarSegments;
    const Vec3d d = arc.direction(i);
    const bool pole = (j == 0 && zmin <= -radius) || (j == kPolarSegments && zmax >= radius);
    const double s = pole ? 0 : std::sin(theta);  // sin(pi) is not quite 0
    const Vec3d n{s * d.x, s * d.y, std::cos(theta)};
    return Point{{radius * n.x, radius * n.y, radius * n.z}, n};
  };
  return grid(arc.segments, kPolarSegments, true, point);
}

TriangleMesh cylinder_mesh(double radius, double zmin, double zmax, double phimax) {
  const Arc arc(phimax);
  const auto point = [&](int i, int j) {
    const Vec3d d = arc.direction(i);
    return Point{{radius * d.x, radius * d.y, j == 0 ? zmin : zmax}, d};
  };
  return grid(arc.segments, 1, true, point);
}

TriangleMesh disk_mesh(double height, double radius, double inner_radius, double phimax) {
  const Arc arc(phimax);
  const auto point = [&](int i, int j) {
    const Vec3d d = arc.direction(i);
    const double r = j == 0 ? radius : inner_radius;
    return Point{{r * d.x, r * d.y, height}, {0, 0, 1}};
  };
  return grid(arc.segments, 1, false, point);
}

TriangleMesh patch_mesh(const std::array<Vec3f, 4>& corners) {
  std::array<Vec3d, 4> c;
  for (size_t k = 0; k < 4; ++k) c[k] = {corners[k].x, corners[k].y, corners[k].z};
  const auto edge = [&](size_t a, size_t b) {
    return Vec3d{c[b].x - c[a].x, c[b].y - c[a].y, c[b].z - c[a].z};
  };
  const Vec3d n = cross(edge(0, 1), edge(0, 2)), across = edge(0, 3);
  const double height = std::abs(n.x * across.x + n.y * across.y + n.z * across.z);
  const bool flat = height <= 1e-6 * length(n) * length(across);
  const int segments = flat ? 1 : kPatchSegments;
  const auto point = [&](int i, int j) {
    const double u = static_cast<double>(i) / segments, v = static_cast<double>(j) / segments;
    const double w[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
    Point at{};
    for (size_t k = 0; k < 4; ++k) {
      at.p = {at.p.x + w[k] * c[k].x, at.p.y + w[k] * c[k].y, at.p.z + w[k] * c[k].z};
    }
    return at;
  };
  return grid(segments, segments, false, point);
}

void append_mesh(TriangleMesh* mesh, const TriangleMesh& part) {
  const auto first = static_cast<uint32_t>(mesh->positions.size());
  mesh->positions.insert(mesh->positions.end(), part.positions.begin(), part.positions.end());
  mesh->normals.insert(mesh->normals.end(), part.normals.begin(), part.normals.end());
  mesh->uvs.insert(mesh->uvs.end(), part.uvs.begin(), part.uvs.end());
  for (const auto& t : part.triangles) mesh->triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

}  // namespace lightmill
