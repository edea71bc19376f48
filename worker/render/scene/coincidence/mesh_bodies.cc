#include "worker/render/scene/coincidence/mesh_bodies.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace lightmill {
namespace {

constexpr int kSizeBits = 12;

/// Without the bits that rounding of vertices may change.
double rough(double x) {
  int exponent = 0;
  const double m = std::frexp(x, &exponent);
  return std::ldexp(std::round(std::ldexp(m, kSizeBits)), exponent - kSizeBits);
}

}  // namespace

MeshBodies::MeshBodies(const PlacedMesh& mesh, const float* positions, bool touch)
    : triangles_(mesh.mesh->triangles) {
  const size_t count = mesh.mesh->positions.size();
  const float* p = positions + 3 * mesh.first_vertex;
  const auto at = [p](uint32_t v) { return std::tuple(p[3 * v], p[3 * v + 1], p[3 * v + 2]); };
  std::vector<uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0u);
  std::erase_if(order, [&](uint32_t v) { return !std::isfinite(p[3 * v] + p[3 * v + 1] + p[3 * v + 2]); });
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return std::tuple(at(a), a) < std::tuple(at(b), b); });
  corner_.resize(count);
  std::iota(corner_.begin(), corner_.end(), 0u);
  for (size_t i = 1; i < order.size(); ++i) {
    if (at(order[i]) == at(order[i - 1])) corner_[order[i]] = corner_[order[i - 1]];
  }
  join_parts(touch);
  if (touch) split_corners();
  measure(mesh, positions);
}

void MeshBodies::join_parts(bool touch) {
  Groups parts(corner_.size());
  for (const auto& t : triangles_) {
    const auto vertex = [&](size_t k) { return touch ? t[k] : corner_[t[k]]; };
    parts.join(vertex(0), vertex(1)), parts.join(vertex(0), vertex(2));
  }
  if (touch) {
    // Corners at the ends, and the vertex at the first: three of one edge stand next to each other.
    std::vector<std::array<uint32_t, 3>> edges;
    for (const auto& t : triangles_) {
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t a = t[k], b = t[(k + 1) % 3];
        edges.push_back({std::min(corner_[a], corner_[b]), std::max(corner_[a], corner_[b]), a});
      }
    }
    std::sort(edges.begin(), edges.end());
    const auto same = [&](size_t i, size_t j) {
      return j < edges.size() && edges[i][0] == edges[j][0] && edges[i][1] == edges[j][1];
    };
    for (size_t i = 0, end; i < edges.size(); i = end) {
      for (end = i + 1; same(i, end);) ++end;
      if (end == i + 2) parts.join(edges[i][2], edges[i + 1][2]);
    }
  }
  constexpr uint32_t kNone = ~0u;
  std::vector<uint32_t> number(corner_.size(), kNone);
  body_of_vertex_.assign(corner_.size(), kNone);
  uint32_t count = 0;
  for (const auto& t : triangles_) {
    for (const uint32_t v : t) {
      uint32_t& n = number[parts.of(touch ? v : corner_[v])];
      if (n == kNone) n = count++;
      body_of_vertex_[v] = n;
    }
  }
  bodies_.resize(count);
}

/// Corners of different bodies become different.
void MeshBodies::split_corners() {
  std::vector<std::array<uint32_t, 3>> at;
  for (uint32_t v = 0; v < corner_.size(); ++v) at.push_back({corner_[v], body_of_vertex_[v], v});
  std::sort(at.begin(), at.end());
  for (size_t i = 0; i < at.size(); ++i) {
    const bool first = i == 0 || at[i][0] != at[i - 1][0] || at[i][1] != at[i - 1][1];
    corner_[at[i][2]] = first ? at[i][2] : corner_[at[i - 1][2]];
  }
}

void MeshBodies::measure(const PlacedMesh& mesh, const float* positions) {
  for (Body& b : bodies_) std::fill_n(b.lo, 3, 1e300), std::fill_n(b.hi, 3, -1e300);
  std::vector<double> area(bodies_.size(), 0), volume(bodies_.size(), 0);
  std::vector<uint32_t> largest(bodies_.size(), 0);
  const auto count = static_cast<uint32_t>(triangles_.size());
  for (uint32_t t = 0; t < count; ++t) {
    const uint32_t i = body_of(t);
    const FaceCorners p = face_corners(mesh, positions, t);
    for (const Vec3d& v : p) {
      const double c[3] = {v.x, v.y, v.z};
      for (int k = 0; k < 3; ++k) {
        bodies_[i].lo[k] = std::min(bodies_[i].lo[k], c[k]);
        bodies_[i].hi[k] = std::max(bodies_[i].hi[k], c[k]);
      }
    }
    const double a = FacePlane(p).area;
    if (a > area[i]) area[i] = a, largest[i] = t;
  }
  for (size_t i = 0; i < bodies_.size(); ++i) {
    Body& b = bodies_[i];
    b.size = rough(std::hypot(b.hi[0] - b.lo[0], b.hi[1] - b.lo[1], b.hi[2] - b.lo[2]));
    b.flat = true;
  }
  for (uint32_t t = 0; t < count; ++t) {
    const uint32_t i = body_of(t);
    Body& b = bodies_[i];
    const FaceCorners p = face_corners(mesh, positions, t), base = face_corners(mesh, positions, largest[i]);
    const FacePlane own(p), plane(base);
    for (const Vec3d& v : p) {
      b.flat = b.flat && std::fabs(along(minus(v, base[0]), plane.normal)) <=
                             4 * same_within(std::max(own.coordinate, plane.coordinate), mesh.rounding);
    }
    const Vec3d center{0.5 * (b.lo[0] + b.hi[0]), 0.5 * (b.lo[1] + b.hi[1]), 0.5 * (b.lo[2] + b.hi[2])};
    volume[i] += along(minus(p[0], center), own.normal) * own.area / 6;
  }
  for (size_t i = 0; i < bodies_.size(); ++i) {
    constexpr double kEncloses = 1e-6;  // of its size
    const double part = volume[i] / (bodies_[i].size * area[i]);
    if (!bodies_[i].flat && std::fabs(part) > kEncloses) bodies_[i].winding_outwards = part > 0 ? 1 : -1;
  }
}

}  // namespace lightmill
