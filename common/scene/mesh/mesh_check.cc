#include "common/scene/mesh/mesh_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "common/base/error.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

bool finite(const Vec3f& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

Vec3d edge(const Vec3f& from, const Vec3f& to) {
  return {double{to.x} - from.x, double{to.y} - from.y, double{to.z} - from.z};
}

/// Twice the triangle's area times its normal. Differences of floats are exact enough in double that a sliver
/// keeps its area.
Vec3d doubled_area(const TriangleMesh& mesh, const std::array<uint32_t, 3>& t) {
  const Vec3f& p = mesh.positions[t[0]];
  return cross(edge(p, mesh.positions[t[1]]), edge(p, mesh.positions[t[2]]));
}

bool has_direction(const Vec3f& n) {
  const double square = double{n.x} * n.x + double{n.y} * n.y + double{n.z} * n.z;
  return square > 1e-60;
}

}  // namespace

void require_valid_mesh(const TriangleMesh& mesh) {
  const size_t count = mesh.positions.size();
  if (!mesh.normals.empty() && mesh.normals.size() != count) {
    fail_scene("has " + std::to_string(mesh.normals.size()) + " normals for " + std::to_string(count) +
               " vertices");
  }
  if (!mesh.uvs.empty() && mesh.uvs.size() != count) {
    fail_scene("has " + std::to_string(mesh.uvs.size()) + " uv pairs for " + std::to_string(count) +
               " vertices");
  }
  for (size_t i = 0; i < count; ++i) {
    if (!finite(mesh.positions[i])) fail_scene("vertex " + std::to_string(i) + " is not finite");
  }
  for (size_t i = 0; i < mesh.normals.size(); ++i) {
    if (!finite(mesh.normals[i])) fail_scene("the normal of vertex " + std::to_string(i) + " is not finite");
  }
  for (size_t i = 0; i < mesh.uvs.size(); ++i) {
    if (!std::isfinite(mesh.uvs[i].x) || !std::isfinite(mesh.uvs[i].y)) {
      fail_scene("the uv of vertex " + std::to_string(i) + " is not finite");
    }
  }
  for (size_t i = 0; i < mesh.second_uvs.size(); ++i) {
    if (!std::isfinite(mesh.second_uvs[i].x) || !std::isfinite(mesh.second_uvs[i].y))
      fail_scene("the second uv of vertex " + std::to_string(i) + " is not finite");
  }
  for (size_t i = 0; i < mesh.colors.size(); ++i) {
    if (!std::ranges::all_of(mesh.colors[i], [](float x) { return std::isfinite(x); }))
      fail_scene("the colour of vertex " + std::to_string(i) + " is not finite");
  }
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (uint32_t v : mesh.triangles[i]) {
      if (v >= count) {
        fail_scene("triangle " + std::to_string(i) + " refers to vertex " + std::to_string(v) +
                   ", but there are " + std::to_string(count));
      }
    }
  }
}

MeshRepairs mend_values(TriangleMesh* mesh) {
  MeshRepairs repairs;
  for (Vec3f& n : mesh->normals) {
    if (finite(n)) continue;
    n = {};
    ++repairs.normals;
  }
  for (std::vector<Vec2f>* uvs : {&mesh->uvs, &mesh->second_uvs}) {
    for (Vec2f& uv : *uvs) {
      if (std::isfinite(uv.x) && std::isfinite(uv.y)) continue;
      uv = {};
      ++repairs.uvs;
    }
  }
  std::vector<Vec3f>& positions = mesh->positions;
  repairs.triangles = std::erase_if(mesh->triangles, [&](const std::array<uint32_t, 3>& t) {
    return std::any_of(t.begin(), t.end(),
                       [&](uint32_t v) { return v >= positions.size() || !finite(positions[v]); });
  });
  for (Vec3f& p : positions) {
    if (!finite(p)) p = {};  // of no triangle
  }
  return repairs;
}

size_t drop_zero_area_triangles(TriangleMesh* mesh) {
  return std::erase_if(mesh->triangles, [&](const std::array<uint32_t, 3>& t) {
    const Vec3d n = doubled_area(*mesh, t);
    return n.x == 0 && n.y == 0 && n.z == 0;
  });
}

size_t mend_zero_normals(TriangleMesh* mesh) {
  size_t bad = 0;
  for (const Vec3f& n : mesh->normals) bad += has_direction(n) ? 0 : 1;
  if (bad == 0) return 0;
  std::vector<Vec3d> sums(mesh->positions.size());
  for (const auto& t : mesh->triangles) {
    const Vec3d n = doubled_area(*mesh, t);
    for (uint32_t v : t) sums[v] = {sums[v].x + n.x, sums[v].y + n.y, sums[v].z + n.z};
  }
  for (size_t i = 0; i < sums.size(); ++i) {
    if (has_direction(mesh->normals[i])) continue;
    const double n = length(sums[i]);
    // A vertex of no triangle, or one whose triangles cancel: any direction will do.
    mesh->normals[i] = n > 0 ? Vec3f{static_cast<float>(sums[i].x / n), static_cast<float>(sums[i].y / n),
                                     static_cast<float>(sums[i].z / n)}
                             : Vec3f{0, 0, 1};
  }
  return bad;
}

double mesh_area(const TriangleMesh& mesh, const Transform& transform) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3f& p = mesh.positions[t[0]];
    sum += length(cross(transform_vector(transform, edge(p, mesh.positions[t[1]])),
                        transform_vector(transform, edge(p, mesh.positions[t[2]]))));
  }
  return sum / 2;
}

}  // namespace lightmill
