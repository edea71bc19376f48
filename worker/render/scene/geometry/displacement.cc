#include "worker/render/scene/geometry/displacement.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <string>
#include <unordered_map>
#include <utility>

#include "common/base/parallel.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

using Vec = Vec3<float>;

Vec vec(const Vec3f& p) { return {p.x, p.y, p.z}; }
Vec3f stored(const Vec& v) { return {v.x, v.y, v.z}; }
Vec unit_or_zero(const Vec& v) {
  const float length = std::sqrt(dot(v, v));
  return length > 0 && std::isfinite(length) ? v * (1 / length) : Vec{0, 0, 0};
}

/// Splits edges in halves. An edge is split in all its triangles or in none, so that no gaps open.
class Refiner {
 public:
  Refiner(TriangleMesh* mesh, const Transform& to_world, double edge_length, size_t most_triangles)
      : mesh_(*mesh), to_world_(to_world), longest_(edge_length), most_(most_triangles) {}

  /// False if the mesh would get too large before all edges are short.
  bool run() {
    for (;;) {
      middle_.clear();
      size_t more = 0;
      for (const auto& t : mesh_.triangles) {
        for (size_t k = 0; k < 3; ++k) more += is_long(t[k], t[(k + 1) % 3]);
      }
      if (more == 0) return true;
      if (mesh_.triangles.size() + more > most_) return false;
      std::vector<std::array<uint32_t, 3>> triangles;
      triangles.reserve(mesh_.triangles.size() + more);
      triangles.swap(mesh_.triangles);
      for (const auto& t : triangles) split(t);
    }
  }

 private:
  bool is_long(uint32_t a, uint32_t b) const {
    const auto at = [&](uint32_t i) {
      const Vec3f& p = mesh_.positions[i];
      return transform_point(to_world_, {p.x, p.y, p.z});
    };
    const Vec3d p = at(a), q = at(b);
    return std::hypot(p.x - q.x, p.y - q.y, p.z - q.z) > longest_;
  }

  void split(const std::array<uint32_t, 3>& t) {
    constexpr uint32_t kNone = ~uint32_t{0};
    uint32_t m[3];
    int count = 0;
    for (size_t k = 0; k < 3; ++k) {
      const bool cut = is_long(t[k], t[(k + 1) % 3]);
      m[k] = cut ? middle(t[k], t[(k + 1) % 3]) : kNone;
      count += cut;
    }
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) { mesh_.triangles.push_back({a, b, c}); };
    if (count == 0) return add(t[0], t[1], t[2]);
    // Turned so that the first edge is cut and, if two are, the second, too.
    size_t k = 0;
    while (m[k] == kNone || (count == 2 && m[(k + 1) % 3] == kNone)) ++k;
    const uint32_t a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3];
    const uint32_t ab = m[k], bc = m[(k + 1) % 3], ca = m[(k + 2) % 3];
    if (count == 1) return add(a, ab, c), add(ab, b, c);
    add(ab, b, bc);
    if (count == 2) return add(a, ab, c), add(ab, bc, c);
    add(a, ab, ca), add(ca, bc, c), add(ab, bc, ca);
  }

  uint32_t middle(uint32_t a, uint32_t b) {
    const uint64_t key = uint64_t{std::min(a, b)} << 32 | std::max(a, b);
    const auto [found, is_new] = middle_.try_emplace(key, static_cast<uint32_t>(mesh_.positions.size()));
    if (!is_new) return found->second;
    const auto half = [&](auto* values, const auto& mean) {
      if (!values->empty()) values->push_back(mean((*values)[a], (*values)[b]));
    };
    const auto of3 = [](const Vec3f& p, const Vec3f& q) {
      return Vec3f{0.5f * p.x + 0.5f * q.x, 0.5f * p.y + 0.5f * q.y, 0.5f * p.z + 0.5f * q.z};
    };
    const auto of2 = [](const Vec2f& p, const Vec2f& q) {
      return Vec2f{0.5f * p.x + 0.5f * q.x, 0.5f * p.y + 0.5f * q.y};
    };
    const auto of4 = [](const std::array<float, 4>& p, const std::array<float, 4>& q) {
      std::array<float, 4> mean;
      for (size_t i = 0; i < 4; ++i) mean[i] = 0.5f * p[i] + 0.5f * q[i];
      return mean;
    };
    half(&mesh_.positions, of3);
    half(&mesh_.normals, of3);
    half(&mesh_.uvs, of2);
    half(&mesh_.second_uvs, of2);
    half(&mesh_.colors, of4);
    return found->second;
  }

  TriangleMesh& mesh_;
  const Transform& to_world_;
  double longest_;
  size_t most_;
  std::unordered_map<uint64_t, uint32_t> middle_;  // of edges, by their ends
};

/// For each vertex the number of its group: vertices whose keys are equal.
template <class Key>
std::vector<uint32_t> groups_of(const std::vector<Key>& keys, size_t* count) {
  std::vector<uint32_t> order(keys.size()), group(keys.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return keys[a] != keys[b] ? keys[a] < keys[b] : a < b; });
  *count = 0;
  for (size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || keys[order[i]] != keys[order[i - 1]]) ++*count;
    group[order[i]] = static_cast<uint32_t>(*count - 1);
  }
  return group;
}

/// Normals of groups of vertices: those of their triangles, weighted by the angle at the vertex.
std::vector<Vec> group_normals(const TriangleMesh& mesh, const std::vector<uint32_t>& group, size_t count) {
  std::vector<Vec> normals(count, Vec{0, 0, 0});
  for (const auto& t : mesh.triangles) {
    const Vec p[3] = {vec(mesh.positions[t[0]]), vec(mesh.positions[t[1]]), vec(mesh.positions[t[2]])};
    const Vec face = unit_or_zero(cross(p[1] - p[0], p[2] - p[0]));
    for (size_t k = 0; k < 3; ++k) {
      const Vec a = unit_or_zero(p[(k + 1) % 3] - p[k]), b = unit_or_zero(p[(k + 2) % 3] - p[k]);
      const float angle = std::acos(std::clamp(dot(a, b), -1.0f, 1.0f));
      normals[group[t[k]]] = normals[group[t[k]]] + face * angle;
    }
  }
  for (Vec& n : normals) n = unit_or_zero(n);
  return normals;
}

class Displacer {
 public:
  Displacer(const ShapeDescription& shape, const TextureTable& textures, int threads)
      : shape_(shape),
        textures_(textures),
        threads_(threads),
        mesh_(*std::get<MeshShape>(shape.kind).mesh),
        had_normals_(!mesh_.normals.empty()) {}

  /// False if edges stayed too long.
  bool run(size_t most_triangles) {
    const bool refined = !(shape_.edge_length > 0) ||
                         Refiner(&mesh_, shape_.object_to_world, shape_.edge_length, most_triangles).run();
    std::vector<std::array<uint32_t, 3>> places(mesh_.positions.size());
    const auto bits = [](float x) { return std::bit_cast<uint32_t>(x + 0.0f); };  // of -0 those of 0
    std::transform(mesh_.positions.begin(), mesh_.positions.end(), places.begin(), [&](const Vec3f& p) {
      return std::array<uint32_t, 3>{bits(p.x), bits(p.y), bits(p.z)};
    });
    size_t count = 0;
    const std::vector<uint32_t> group = groups_of(places, &count);
    // Before vertices move: those that share a normal still do afterwards.
    size_t smooth_count = 0;
    const std::vector<uint32_t> smooth =
        had_normals_ ? smooth_groups(group, &smooth_count) : std::vector<uint32_t>();
    move(group, count);
    if (had_normals_) {
      const std::vector<Vec> normals = group_normals(mesh_, smooth, smooth_count);
      for (size_t i = 0; i < mesh_.normals.size(); ++i) {
        const Vec& n = normals[smooth[i]];
        if (dot(n, n) > 0) mesh_.normals[i] = stored(n);
      }
    }
    return refined;
  }
  TriangleMesh take() { return std::move(mesh_); }

 private:
  std::vector<uint32_t> smooth_groups(const std::vector<uint32_t>& group, size_t* count) const {
    std::vector<std::array<uint32_t, 4>> keys(group.size());
    for (size_t i = 0; i < keys.size(); ++i) {
      const Vec n = unit_or_zero(vec(mesh_.normals[i]));
      // Rounded: what exporters wrote apart by rounding is one.
      const auto rounded = [](float x) { return static_cast<uint32_t>(std::lround(x * 1024)); };
      keys[i] = {group[i], rounded(n.x), rounded(n.y), rounded(n.z)};
    }
    return groups_of(keys, count);
  }

  void move(const std::vector<uint32_t>& group, size_t count) {
    const std::vector<Vec> of_faces = had_normals_ ? std::vector<Vec>() : group_normals(mesh_, group, count);
    std::vector<Vec> way(mesh_.positions.size());
    constexpr size_t kChunk = 4096;
    parallel_for((way.size() + kChunk - 1) / kChunk, threads_, [&](size_t chunk) {
      const size_t end = std::min(way.size(), (chunk + 1) * kChunk);
      for (size_t i = chunk * kChunk; i < end; ++i) {
        const Vec n = unit_or_zero(had_normals_ ? vec(mesh_.normals[i]) : of_faces[group[i]]);
        const FloatInput& in = shape_.displacement;
        const float h = in.texture < 0 ? in.value : textures_.evaluate(in.texture, point(i, n)).r;
        way[i] = n * (std::isfinite(h) ? h : 0.0f);
      }
    });
    std::vector<Vec> sum(count, Vec{0, 0, 0});
    std::vector<uint32_t> number(count);
    for (size_t i = 0; i < way.size(); ++i) {
      sum[group[i]] = sum[group[i]] + way[i];
      ++number[group[i]];
    }
    for (size_t i = 0; i < way.size(); ++i) {
      const Vec to = vec(mesh_.positions[i]) + sum[group[i]] * (1 / static_cast<float>(number[group[i]]));
      if (std::isfinite(to.x) && std::isfinite(to.y) && std::isfinite(to.z)) mesh_.positions[i] = stored(to);
    }
  }

  TexturePoint point(size_t i, const Vec& normal) const {
    const Vec3f& p = mesh_.positions[i];
    TexturePoint at;
    at.p = transform_point(shape_.object_to_world, {p.x, p.y, p.z});
    if (!mesh_.uvs.empty()) at.u = mesh_.uvs[i].x, at.v = mesh_.uvs[i].y;
    if (!mesh_.second_uvs.empty()) at.second_u = mesh_.second_uvs[i].x, at.second_v = mesh_.second_uvs[i].y;
    if (!mesh_.colors.empty()) at.color = mesh_.colors[i];
    at.n = at.ns = in_world(normal);
    return at;
  }

  /// A unit normal as that of the placed surface.
  Vec in_world(const Vec& normal) const {
    const Frame<float> frame(normal);
    const auto placed = [&](const Vec& v) {
      const Vec3d w = transform_vector(shape_.object_to_world, {v.x, v.y, v.z});
      return Vec{static_cast<float>(w.x), static_cast<float>(w.y), static_cast<float>(w.z)};
    };
    const Vec across = unit_or_zero(cross(placed(frame.s), placed(frame.t)));
    return determinant3(shape_.object_to_world) < 0 ? -across : across;
  }

  const ShapeDescription& shape_;
  const TextureTable& textures_;
  int threads_;
  TriangleMesh mesh_;
  bool had_normals_;
};

bool is_displaced(const ShapeDescription& shape) {
  return (shape.displacement.texture >= 0 || shape.displacement.value != 0) &&
         std::holds_alternative<MeshShape>(shape.kind);
}

}  // namespace

std::optional<SceneDescription> with_displaced_meshes(const SceneDescription& description,
                                                      const TextureTable& textures, int threads,
                                                      std::vector<Problem>* warnings, size_t most_triangles) {
  const auto any = [](const std::vector<ShapeDescription>& shapes) {
    return std::any_of(shapes.begin(), shapes.end(), is_displaced);
  };
  if (!any(description.shapes) && std::none_of(description.objects.begin(), description.objects.end(),
                                               [&](const ObjectDescription& o) { return any(o.shapes); }))
    return std::nullopt;
  std::optional<SceneDescription> out(description);
  const auto displace = [&](std::vector<ShapeDescription>& shapes) {
    for (ShapeDescription& shape : shapes) {
      if (!is_displaced(shape)) continue;
      Displacer displacer(shape, textures, threads);
      if (!displacer.run(most_triangles)) {
        warnings->push_back({shape.location, Severity::kWarning,
                             "the displaced mesh would have more than " + std::to_string(most_triangles) +
                                 " triangles with edges as short as \"edgelength\" says; some stay longer"});
      }
      shape.kind = MeshShape{std::make_shared<const TriangleMesh>(displacer.take())};
      shape.displacement = {};
    }
  };
  displace(out->shapes);
  for (ObjectDescription& object : out->objects) displace(object.shapes);
  return out;
}

}  // namespace lightmill
