#include "common/scene/mesh/loop_subdivision.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/error.h"
#include "common/scene/mesh/vec3d_math.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr uint32_t kNone = ~uint32_t{0};

std::string name(uint32_t v) { return "vertex " + std::to_string(v); }

// Half-edge h = 3 f + k runs from corner k of triangle f to corner k + 1.
uint32_t next(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
uint32_t previous(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

/// A manifold with boundary: `twin` of a half-edge is kNone at the boundary.
struct Manifold {
  std::vector<Vec3d> positions;
  std::vector<uint32_t> from;  // per half-edge: its first vertex
  std::vector<uint32_t> twin, edge;
  uint32_t edges = 0;
  std::vector<uint32_t> outgoing;  // per vertex: a half-edge from it, the clockwise last one at a boundary

  uint32_t to(uint32_t h) const { return from[next(h)]; }
  bool on_boundary(uint32_t v) const { return twin[outgoing[v]] == kNone; }

  /// Fills all but positions and `from`. Throws if this is no oriented manifold.
  void connect() {
    const auto count = static_cast<uint32_t>(from.size());
    std::vector<std::pair<uint64_t, uint32_t>> sorted(count);
    for (uint32_t h = 0; h < count; ++h) {
      const uint32_t low = std::min(from[h], to(h)), high = std::max(from[h], to(h));
      if (low == high) fail_scene("has a triangle that names " + name(low) + " twice");
      sorted[h] = {uint64_t{low} << 32 | high, h};
    }
    std::sort(sorted.begin(), sorted.end());
    twin.assign(count, kNone);
    edge.assign(count, 0);
    edges = 0;
    for (uint32_t i = 0; i < count; ++edges) {
      const uint32_t h = sorted[i].second;
      uint32_t end = i + 1;
      while (end < count && sorted[end].first == sorted[i].first) ++end;
      const std::string which = "has an edge from " + name(from[h]) + " to " + name(to(h));
      if (end - i > 2) fail_scene(which + " with more than two triangles; it must be a manifold");
      edge[h] = edges;
      if (end - i == 2) {
        const uint32_t other = sorted[i + 1].second;
        if (from[h] == from[other])
          fail_scene(which + " whose two triangles are wound in opposite senses; reverse one of them");
        twin[h] = other;
        twin[other] = h;
        edge[other] = edges;
      }
      i = end;
    }
    outgoing.assign(positions.size(), kNone);
    for (uint32_t h = 0; h < count; ++h) {
      uint32_t& out = outgoing[from[h]];
      if (out == kNone || twin[h] == kNone) out = h;
    }
  }

  /// The neighbours of `v`, anticlockwise; at a boundary from one boundary edge to the other.
  void ring(uint32_t v, std::vector<uint32_t>* neighbours) const {
    neighbours->clear();
    uint32_t h = outgoing[v];
    do {
      neighbours->push_back(to(h));
      const uint32_t in = previous(h);
      h = twin[in];
      if (h == kNone) neighbours->push_back(from[in]);
    } while (h != kNone && h != outgoing[v]);
  }

  /// Throws if the triangles around some vertex are more than one fan.
  void require_single_fans() const {
    std::vector<uint32_t> degree(positions.size(), 0), neighbours;
    for (uint32_t v : from) ++degree[v];
    for (uint32_t v = 0; v < outgoing.size(); ++v) {
      if (outgoing[v] == kNone) continue;
      ring(v, &neighbours);
      if (neighbours.size() - (on_boundary(v) ? 1 : 0) != degree[v])
        fail_scene("has triangles that meet in " + name(v) + " alone; give each part a vertex of its own");
    }
  }
};

/// The weight of each neighbour of an inner vertex of valence n (Warren 1995).
double neighbour_weight(size_t n) { return n == 3 ? 3.0 / 16 : 3 / (8 * static_cast<double>(n)); }

Manifold refined(const Manifold& m) {
  Manifold fine;
  const auto vertices = static_cast<uint32_t>(m.positions.size());
  fine.positions.resize(m.positions.size() + m.edges);
  std::vector<uint32_t> ring;
  for (uint32_t v = 0; v < vertices; ++v) {
    const Vec3d& p = m.positions[v];
    fine.positions[v] = p;
    if (m.outgoing[v] == kNone) continue;
    m.ring(v, &ring);
    if (m.on_boundary(v)) {
      fine.positions[v] = 0.75 * p + 0.125 * (m.positions[ring.front()] + m.positions[ring.back()]);
      continue;
    }
    Vec3d sum;
    for (uint32_t r : ring) sum = sum + m.positions[r];
    const double w = neighbour_weight(ring.size());
    fine.positions[v] = (1 - w * static_cast<double>(ring.size())) * p + w * sum;
  }
  fine.from.reserve(4 * m.from.size());
  for (uint32_t f = 0; f < m.from.size(); f += 3) {
    uint32_t middle[3];
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t h = f + k, t = m.twin[h];
      middle[k] = vertices + m.edge[h];
      const Vec3d ends = m.positions[m.from[h]] + m.positions[m.to(h)];
      Vec3d& p = fine.positions[middle[k]];
      if (t == kNone) {
        p = 0.5 * ends;
      } else if (h < t) {  // once, so that nothing depends on the side
        p = 0.375 * ends + 0.125 * (m.positions[m.from[previous(h)]] + m.positions[m.from[previous(t)]]);
      }
    }
    for (uint32_t k = 0; k < 3; ++k)
      fine.from.insert(fine.from.end(), {m.from[f + k], middle[k], middle[(k + 2) % 3]});
    fine.from.insert(fine.from.end(), {middle[0], middle[1], middle[2]});
  }
  return fine;
}

struct LimitPoint {
  Vec3d p, n;  // n: anticlockwise about the control triangles, of any length
};

/// Position and normal are the left eigenvectors of the subdivision matrix around the vertex:
/// of eigenvalue 1, and the two that follow (Halstead et al. 1993; Biermann, Levin & Zorin 2000
/// for the method at boundaries).
LimitPoint inner_limit(const Manifold& m, uint32_t v, const std::vector<uint32_t>& ring) {
  const auto n = static_cast<double>(ring.size());
  const double w = 1 / (n + 3 / (8 * neighbour_weight(ring.size())));
  Vec3d sum, s, t;
  for (size_t j = 0; j < ring.size(); ++j) {
    const Vec3d& p = m.positions[ring[j]];
    const double angle = 2 * std::numbers::pi * static_cast<double>(j) / n;
    sum = sum + p;
    // From the vertex, so that a far-away mesh does not cancel.
    s = s + std::cos(angle) * (p - m.positions[v]);
    t = t + std::sin(angle) * (p - m.positions[v]);
  }
  return {(1 - w * n) * m.positions[v] + w * sum, cross(s, t)};
}

LimitPoint boundary_limit(const Manifold& m, uint32_t v, const std::vector<uint32_t>& ring) {
  const Vec3d& p = m.positions[v];
  const Vec3d first = m.positions[ring.front()] - p, last = m.positions[ring.back()] - p;
  const size_t triangles = ring.size() - 1;
  // Across the boundary: eigenvalue 3/8 + cos(theta)/4, inner neighbours weigh sin(j theta), the two on the
  // boundary what makes the row an eigenvector, and the vertex what makes the sum 0.
  Vec3d across = first + last;  // a single triangle: eigenvalue 1/4
  if (triangles > 1) {
    const double theta = std::numbers::pi / static_cast<double>(triangles);
    const double end = (std::sin(theta) - 1 / std::tan(theta / 2)) / (1 + 2 * std::cos(theta));
    across = end * across;
    for (size_t j = 1; j < triangles; ++j)
      across = across + std::sin(static_cast<double>(j) * theta) * (m.positions[ring[j]] - p);
  }
  return {p + 1.0 / 6 * (first + last), cross(first - last, across)};
}

}  // namespace

size_t subdivided_count(const TriangleMesh& control, int levels) {
  size_t count = control.triangles.size();
  for (int i = 0; i < levels && count <= kMaxSubdividedTriangles; ++i) count *= 4;
  if (count > kMaxSubdividedTriangles) {
    fail_scene("has " + std::to_string(control.triangles.size()) + " triangles, which " +
               std::to_string(levels) + " levels make more than " + std::to_string(kMaxSubdividedTriangles) +
               "; use fewer levels");
  }
  return count;
}

TriangleMesh loop_subdivide(const TriangleMesh& control, int levels) {
  subdivided_count(control, levels);
  Manifold m;
  for (const Vec3f& p : control.positions) m.positions.push_back({p.x, p.y, p.z});
  for (const auto& t : control.triangles) m.from.insert(m.from.end(), t.begin(), t.end());
  m.connect();
  m.require_single_fans();
  for (int i = 0; i < levels; ++i) {
    m = refined(m);
    m.connect();
  }
  TriangleMesh mesh;
  mesh.positions.reserve(m.positions.size());
  mesh.normals.reserve(m.positions.size());
  std::vector<uint32_t> ring;
  for (uint32_t v = 0; v < m.positions.size(); ++v) {
    LimitPoint limit{m.positions[v], {0, 0, 1}};
    if (m.outgoing[v] != kNone) {
      m.ring(v, &ring);
      limit = m.on_boundary(v) ? boundary_limit(m, v, ring) : inner_limit(m, v, ring);
    }
    mesh.positions.push_back(to_float(limit.p));
    const double size = length(limit.n);
    mesh.normals.push_back(size > 0 ? to_float(-1 / size * limit.n) : Vec3f{});  // 0: mended from triangles
  }
  mesh.triangles.reserve(m.from.size() / 3);
  for (size_t f = 0; f < m.from.size(); f += 3)
    mesh.triangles.push_back({m.from[f], m.from[f + 2], m.from[f + 1]});
  return mesh;
}

}  // namespace lightmill
