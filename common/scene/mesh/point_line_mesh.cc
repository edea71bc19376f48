#include "common/scene/mesh/point_line_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/transform.h"

namespace lightmill {
namespace {

bool has_place(const Vec3f& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

/// Corners on the unit sphere, and faces wound outwards.
struct Solid {
  std::vector<Vec3f> corners;
  std::vector<std::array<uint32_t, 3>> faces;
};

Solid octahedron() {
  return {{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
          {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
}

Solid icosahedron() {
  const float length = std::sqrt(1 + std::numbers::phi_v<float> * std::numbers::phi_v<float>);
  const float a = 1 / length, b = std::numbers::phi_v<float> / length;
  return {{{-a, b, 0},
           {a, b, 0},
           {-a, -b, 0},
           {a, -b, 0},
           {0, -a, b},
           {0, a, b},
           {0, -a, -b},
           {0, a, -b},
           {b, 0, -a},
           {b, 0, a},
           {-b, 0, -a},
           {-b, 0, a}},
          {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
           {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
           {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
}

/// Adds a vertex at `centre` + `radius` x `normal`.
void add_vertex(const LooseVertices& from, size_t i, const Vec3f& normal, float radius, TriangleMesh* mesh) {
  const Vec3f& c = from.positions[i];
  mesh->positions.push_back({c.x + radius * normal.x, c.y + radius * normal.y, c.z + radius * normal.z});
  mesh->normals.push_back(normal);
  if (!from.colors.empty()) mesh->colors.push_back(from.colors[i]);
}

}  // namespace

float loose_radius(const LooseVertices& vertices) {
  constexpr double kShare = 0.002;
  constexpr float kAlone = 0.01f;  // of a single point
  Vec3d low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
  for (const Vec3f& p : vertices.positions) {
    if (!has_place(p)) continue;
    low = {std::min(low.x, double{p.x}), std::min(low.y, double{p.y}), std::min(low.z, double{p.z})};
    high = {std::max(high.x, double{p.x}), std::max(high.y, double{p.y}), std::max(high.z, double{p.z})};
  }
  const double diagonal = length({high.x - low.x, high.y - low.y, high.z - low.z});
  return low.x <= high.x && diagonal > 0 ? static_cast<float>(kShare * diagonal) : kAlone;
}

TriangleMesh spheres_at(const LooseVertices& points, float radius) {
  constexpr size_t kFew = size_t{1} << 16;
  const size_t step = std::max<size_t>(1, (points.positions.size() + kMostLoose - 1) / kMostLoose);
  const Solid solid = points.positions.size() / step <= kFew ? icosahedron() : octahedron();
  TriangleMesh mesh;
  for (size_t i = 0; i < points.positions.size(); i += step) {
    if (!has_place(points.positions[i])) continue;
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (const Vec3f& corner : solid.corners) add_vertex(points, i, corner, radius, &mesh);
    for (const auto& f : solid.faces) mesh.triangles.push_back({first + f[0], first + f[1], first + f[2]});
  }
  return mesh;
}

TriangleMesh tubes_along(const LooseVertices& vertices, const std::vector<std::array<uint32_t, 2>>& segments,
                         float radius) {
  constexpr uint32_t kSides = 3;
  TriangleMesh mesh;
  for (const auto& [from, to] : segments) {
    if (mesh.triangles.size() >= kMostLoose * 2 * kSides) break;
    const size_t count = vertices.positions.size();
    if (from >= count || to >= count) continue;
    const Vec3f a = vertices.positions[from], b = vertices.positions[to];
    if (!has_place(a) || !has_place(b)) continue;
    const Vec3d along{double{b.x} - a.x, double{b.y} - a.y, double{b.z} - a.z};
    const double n = length(along);
    if (!(n > 0)) continue;
    // Two directions across it.
    const Vec3d least = std::abs(along.x) < 0.6 * n ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
    Vec3d u = cross(along, least);
    const double u_length = length(u);
    u = {u.x / u_length, u.y / u_length, u.z / u_length};
    const Vec3d v = cross({along.x / n, along.y / n, along.z / n}, u);
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    for (uint32_t side = 0; side < kSides; ++side) {
      const double angle = 2 * std::numbers::pi * side / kSides, c = std::cos(angle), s = std::sin(angle);
      const Vec3f normal{static_cast<float>(u.x * c + v.x * s), static_cast<float>(u.y * c + v.y * s),
                         static_cast<float>(u.z * c + v.z * s)};
      add_vertex(vertices, from, normal, radius, &mesh);
      add_vertex(vertices, to, normal, radius, &mesh);
    }
    for (uint32_t side = 0; side < kSides; ++side) {
      const uint32_t p = first + 2 * side, q = first + 2 * ((side + 1) % kSides);
      mesh.triangles.push_back({p, q, q + 1});
      mesh.triangles.push_back({p, q + 1, p + 1});
    }
  }
  return mesh;
}

}  // namespace lightmill
