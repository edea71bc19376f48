#include "common/scene/mesh/tessellate.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/mesh/mesh_check.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kAroundSegments = 1024;  // a full turn of a disk or cylinder
constexpr int kMostPatchSegments = 64;

struct Point {
  Vec3d p, n;
  Vec2f uv;
};

/// Grid of nu x nv quads over (u, v) in [0,1]^2; `point(i, j)` gives position, normal and uv.
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
      mesh.uvs.push_back(at.uv);
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

Vec2f fraction(int i, int nu, int j, int nv) {
  return {static_cast<float>(i) / static_cast<float>(nu), static_cast<float>(j) / static_cast<float>(nv)};
}

/// Segments for an arc, and the angle of its i-th end; a full turn closes exactly.
struct Arc {
  Arc(double phimax, int full_turn)
      : phi(std::min(phimax, kTurn)),
        segments(std::max(3, static_cast<int>(std::ceil(full_turn * phi / kTurn)))) {}
  Vec3d direction(int i) const {
    const double angle = i == segments && phi == kTurn ? 0 : phi * i / segments;
    return {std::cos(angle), std::sin(angle), 0};
  }
  /// Angle between neighbouring ends.
  double step() const { return phi / segments; }
  double phi;
  int segments;
};

}  // namespace

TriangleMesh sphere_mesh(double radius, double zmin, double zmax, double phimax, int segments) {
  const Arc arc(phimax, segments);
  const double first = std::acos(std::clamp(zmin / radius, -1.0, 1.0));
  const double last = std::acos(std::clamp(zmax / radius, -1.0, 1.0));
  const int polar = std::max(2, static_cast<int>(std::ceil(segments * (first - last) / kTurn)));
  const auto point = [&](int i, int j) {
    const double theta = first + (last - first) * j / polar;
    const Vec3d d = arc.direction(i);
    const bool pole = (j == 0 && zmin <= -radius) || (j == polar && zmax >= radius);
    const double s = pole ? 0 : std::sin(theta);  // sin(pi) is not quite 0
    const Vec3d n{s * d.x, s * d.y, std::cos(theta)};
    return Point{n, n, fraction(i, arc.segments, j, polar)};
  };
  TriangleMesh mesh = grid(arc.segments, polar, true, point);
  // Archimedes: a zone's area is its angle times its height.
  const double area = arc.phi * (std::cos(last) - std::cos(first));
  const double scale = radius * std::sqrt(area / mesh_area(mesh, {}));
  for (Vec3f& p : mesh.positions) {
    p = {static_cast<float>(p.x * scale), static_cast<float>(p.y * scale), static_cast<float>(p.z * scale)};
  }
  return mesh;
}

TriangleMesh cylinder_mesh(double radius, double zmin, double zmax, double phimax) {
  const Arc arc(phimax, kAroundSegments);
  const double r = radius * arc.step() / 2 / std::sin(arc.step() / 2);  // a chord as long as its arc
  const auto point = [&](int i, int j) {
    const Vec3d d = arc.direction(i);
    return Point{{r * d.x, r * d.y, j == 0 ? zmin : zmax}, d, fraction(i, arc.segments, j, 1)};
  };
  return grid(arc.segments, 1, true, point);
}

TriangleMesh disk_mesh(double height, double radius, double inner_radius, double phimax) {
  const Arc arc(phimax, kAroundSegments);
  const double widen = std::sqrt(arc.step() / std::sin(arc.step()));  // a triangle as large as its sector
  const auto point = [&](int i, int j) {
    const Vec3d d = arc.direction(i);
    const double r = widen * (j == 0 ? radius : inner_radius);
    return Point{{r * d.x, r * d.y, height}, {0, 0, 1}, fraction(i, arc.segments, j, 1)};
  };
  return grid(arc.segments, 1, false, point);
}

namespace {

using Corners = std::array<Vec3d, 4>;

Corners in_double(const std::array<Vec3f, 4>& v) {
  Corners c;
  for (size_t k = 0; k < 4; ++k) c[k] = {v[k].x, v[k].y, v[k].z};
  return c;
}

Vec3d minus(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

Vec3d bilinear(const Corners& c, double u, double v) {
  const double w[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
  Vec3d sum;
  for (size_t k = 0; k < 4; ++k) sum = {sum.x + w[k] * c[k].x, sum.y + w[k] * c[k].y, sum.z + w[k] * c[k].z};
  return sum;
}

Vec3d surface_normal(const Corners& c, double u, double v) {
  const auto along = [](const Vec3d& a, const Vec3d& b, double t) {
    return Vec3d{a.x + t * (b.x - a.x), a.y + t * (b.y - a.y), a.z + t * (b.z - a.z)};
  };
  return cross(along(minus(c[1], c[0]), minus(c[3], c[2]), v),
               along(minus(c[2], c[0]), minus(c[3], c[1]), u));
}

Vec3d unit_or_zero(const Vec3d& n) {
  const double size = length(n);
  return size > 0 && std::isfinite(size) ? Vec3d{n.x / size, n.y / size, n.z / size} : Vec3d{};
}

}  // namespace

int patch_segments(const BilinearPatch& patch) {
  const Corners c = in_double(patch.corners);
  // The surface is a parallelogram plus u v times this; a cell's diagonal misses it by a quarter of its part.
  const Vec3d twist = minus(minus(c[3], c[1]), minus(c[2], c[0]));
  const double size = std::max(length(minus(c[3], c[0])), length(minus(c[2], c[1])));
  if (!(size > 0)) return 1;
  const double out = std::abs(dot(twist, unit_or_zero(surface_normal(c, 0.5, 0.5))));
  const auto& t = patch.uvs;
  const double uv_size =
      std::max(std::hypot(t[3].x - t[0].x, t[3].y - t[0].y), std::hypot(t[2].x - t[1].x, t[2].y - t[1].y));
  const double uv_twist = std::hypot(t[3].x - t[1].x - t[2].x + t[0].x, t[3].y - t[1].y - t[2].y + t[0].y);
  const double cells = std::max(
      {out / (4e-4 * size), length(twist) / (4e-2 * size), uv_size > 0 ? uv_twist / (4e-2 * uv_size) : 0.0});
  return static_cast<int>(std::clamp(std::ceil(std::sqrt(cells)), 1.0, double{kMostPatchSegments}));
}

TriangleMesh patch_mesh(const BilinearPatch& patch, bool with_normals) {
  const int segments = patch_segments(patch);
  const Corners c = in_double(patch.corners);
  Corners normals{}, uvs;
  if (patch.normals != nullptr) normals = in_double(*patch.normals);
  for (size_t k = 0; k < 4; ++k) uvs[k] = {patch.uvs[k].x, patch.uvs[k].y, 0};
  const auto point = [&](int i, int j) {
    const double u = static_cast<double>(i) / segments, v = static_cast<double>(j) / segments;
    const Vec3d n = patch.normals != nullptr ? bilinear(normals, u, v) : surface_normal(c, u, v);
    const Vec3d uv = bilinear(uvs, u, v);
    return Point{bilinear(c, u, v), unit_or_zero(n), {static_cast<float>(uv.x), static_cast<float>(uv.y)}};
  };
  return grid(segments, segments, with_normals, point);
}

void append_mesh(TriangleMesh* mesh, const TriangleMesh& part) {
  const auto first = static_cast<uint32_t>(mesh->positions.size());
  mesh->positions.insert(mesh->positions.end(), part.positions.begin(), part.positions.end());
  mesh->normals.insert(mesh->normals.end(), part.normals.begin(), part.normals.end());
  mesh->uvs.insert(mesh->uvs.end(), part.uvs.begin(), part.uvs.end());
  for (const auto& t : part.triangles) mesh->triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

}  // namespace lightmill
