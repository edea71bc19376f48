// Shape "bilinearmesh": patches p00, p10, p01, p11.
#include <algorithm>

#include "common/base/error.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/mesh/tessellate.h"
#include "common/scene/pbrt/shapes/quadrics.h"

namespace lightmill {
namespace {

/// Corners of all patches by number, checked against the count of vertices; nullopt: reported.
std::optional<std::vector<std::array<uint32_t, 4>>> read_corners(ParameterList& params, size_t vertices) {
  const auto* indices = params.numbers("indices", ParamType::kInteger);
  if (indices == nullptr) {
    if (params.has("indices")) return std::nullopt;  // reported
    if (vertices == 4) return {{{0, 1, 2, 3}}};
    params.left_out("needs \"integer indices\" unless it is one patch");
    return std::nullopt;
  }
  if (indices->size() % 4 != 0) {
    params.left_out("has " + std::to_string(indices->size()) + " indices; it needs 4 per patch");
    return std::nullopt;
  }
  std::vector<std::array<uint32_t, 4>> patches(indices->size() / 4);
  for (size_t i = 0; i < indices->size(); ++i) {
    const double at = (*indices)[i];
    if (at < 0 || at >= static_cast<double>(vertices)) {
      params.left_out("refers to a vertex that does not exist");
      return std::nullopt;
    }
    patches[i / 4][i % 4] = static_cast<uint32_t>(at);
  }
  return patches;
}

Vec3f vec3(const std::vector<double>& v, size_t i) {
  return {static_cast<float>(v[3 * i]), static_cast<float>(v[3 * i + 1]), static_cast<float>(v[3 * i + 2])};
}

}  // namespace

std::optional<ReadShape> read_bilinear_mesh(PbrtScene& out, ParameterList& params) {
  const auto* positions = params.numbers("P", ParamType::kPoint3);
  const auto* normals = params.numbers("N", ParamType::kNormal);
  const auto* uvs = params.numbers("uv", ParamType::kPoint2);
  params.accept({"faceIndices", "indices", "emissionfilename"});  // the last guides pbrt's sampling alone
  if (positions == nullptr) {
    if (!params.has("P")) params.left_out("needs \"point3 P\"");
    return std::nullopt;
  }
  // What is given at the vertices is checked as a mesh of them alone.
  TriangleMesh vertices;
  for (size_t i = 0; i < positions->size() / 3; ++i) vertices.positions.push_back(vec3(*positions, i));
  for (size_t i = 0; normals != nullptr && i < normals->size() / 3; ++i)
    vertices.normals.push_back(vec3(*normals, i));
  for (size_t i = 0; uvs != nullptr && i + 1 < uvs->size(); i += 2)
    vertices.uvs.push_back({static_cast<float>((*uvs)[i]), static_cast<float>((*uvs)[i + 1])});
  try {
    require_valid_mesh(vertices);
  } catch (const Error& e) {
    params.left_out(e.what());
    return std::nullopt;
  }
  const auto indices = read_corners(params, vertices.positions.size());
  if (!indices) return std::nullopt;

  std::vector<BilinearPatch> patches(indices->size());
  std::vector<std::array<Vec3f, 4>> patch_normals(normals != nullptr ? indices->size() : 0);
  bool curved = normals != nullptr;
  size_t triangles = 0;
  for (size_t i = 0; i < patches.size(); ++i) {
    BilinearPatch& patch = patches[i];
    for (size_t k = 0; k < 4; ++k) {
      const uint32_t v = (*indices)[i][k];
      patch.corners[k] = vertices.positions[v];
      if (normals != nullptr) patch_normals[i][k] = vertices.normals[v];
      if (uvs != nullptr) patch.uvs[k] = vertices.uvs[v];
    }
    if (normals != nullptr) patch.normals = &patch_normals[i];
    const auto segments = static_cast<size_t>(patch_segments(patch));
    curved = curved || segments > 1;
    triangles += 2 * segments * segments;
  }
  if (!out.may_generate(triangles, params)) return std::nullopt;
  auto mesh = std::make_shared<TriangleMesh>();
  for (const BilinearPatch& patch : patches) append_mesh(mesh.get(), patch_mesh(patch, curved));
  mend_zero_normals(mesh.get());  // at corners that coincide
  return ReadShape{MeshShape{std::move(mesh)}, patches.size()};
}

}  // namespace lightmill
