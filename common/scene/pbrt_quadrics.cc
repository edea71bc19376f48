#include "common/scene/pbrt_quadrics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/tessellate.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kAny = 3e38;
constexpr double kDegree = std::numbers::pi / 180;

ReadShape as_mesh(TriangleMesh mesh) {
  return {MeshShape{std::make_shared<const TriangleMesh>(std::move(mesh))}, 1};
}

void name_approximation(PbrtScene& out, ParameterList& params, const std::string& what,
                        const ReadShape& shape) {
  const size_t count = std::get<MeshShape>(shape.kind).mesh->triangles.size();
  out.problems->unsupported(
      params.where(), "an exact " + what + "; it is approximated by " + std::to_string(count) + " triangles");
}

/// A radius above 0, or 0 if the value was refused.
double read_radius(ParameterList& params) {
  const double radius = params.number("radius", 1, -kAny, kAny);
  if (radius > 0 && static_cast<float>(radius) > 0) return radius;
  params.bad_value("radius", "must be above 0");
  return 0;
}

double read_phimax(ParameterList& params) {
  const double phi = params.number("phimax", 360, 0, 360);
  if (phi > 0) return phi * kDegree;
  params.bad_value("phimax", "must be above 0");
  return 2 * std::numbers::pi;
}

/// zmin < zmax after pbrt's reordering; reports an empty range.
std::optional<std::pair<double, double>> read_range(ParameterList& params, double low, double high) {
  const double a = params.number("zmin", low, -kAny, kAny), b = params.number("zmax", high, -kAny, kAny);
  if (a != b) return std::pair{std::min(a, b), std::max(a, b)};
  params.bad_value("zmax", "must differ from \"zmin\"");
  return std::nullopt;
}

}  // namespace

std::optional<ReadShape> read_sphere(PbrtScene& out, ParameterList& params) {
  const double r = read_radius(params);
  const auto range = read_range(params, -r, r);
  const double phimax = read_phimax(params);
  if (r == 0 || !range) return std::nullopt;
  if (range->first <= -r && range->second >= r && phimax >= 360 * kDegree) {
    return ReadShape{SphereShape{static_cast<float>(r)}, 1};
  }
  if (range->first >= r || range->second <= -r) {
    params.bad_value("zmin", "and \"zmax\" leave nothing of the sphere");
    return std::nullopt;
  }
  ReadShape shape = as_mesh(sphere_mesh(r, std::max(range->first, -r), std::min(range->second, r), phimax));
  name_approximation(out, params, "partial sphere", shape);
  return shape;
}

std::optional<ReadShape> read_disk(PbrtScene& out, ParameterList& params) {
  const double height = params.number("height", 0, -kAny, kAny);
  const double r = read_radius(params);
  const double inner = params.number("innerradius", 0, 0, kAny);
  const double phimax = read_phimax(params);
  if (r == 0) return std::nullopt;
  if (inner >= r) {
    params.bad_value("innerradius", "must be below \"radius\"");
    return std::nullopt;
  }
  ReadShape shape = as_mesh(disk_mesh(height, r, inner, phimax));
  name_approximation(out, params, "disk", shape);
  return shape;
}

std::optional<ReadShape> read_cylinder(PbrtScene& out, ParameterList& params) {
  const double r = read_radius(params);
  const auto range = read_range(params, -1, 1);
  const double phimax = read_phimax(params);
  if (r == 0 || !range) return std::nullopt;
  ReadShape shape = as_mesh(cylinder_mesh(r, range->first, range->second, phimax));
  name_approximation(out, params, "cylinder", shape);
  return shape;
}

std::optional<ReadShape> read_bilinear_mesh(PbrtScene& out, ParameterList& params) {
  const auto* positions = params.numbers("P", ParamType::kPoint3);
  const auto* indices = params.numbers("indices", ParamType::kInteger);
  params.unsupported("N", "is ignored; the patches are flat shaded");
  params.unsupported("uv", "is ignored; each patch spans (0,0) to (1,1)");
  params.unsupported("emissionfilename", "is ignored");
  params.accept({"faceIndices"});
  if (positions == nullptr) {
    if (!params.has("P")) out.problems->error(params.where(), params.owner() + " needs \"point3 P\"");
    return std::nullopt;
  }
  const size_t count = positions->size() / 3;
  std::vector<double> order;
  if (indices != nullptr) {
    order = *indices;
  } else if (params.has("indices")) {
    return std::nullopt;  // reported
  } else if (count == 4) {
    order = {0, 1, 2, 3};
  } else {
    out.problems->error(params.where(), params.owner() + " needs \"integer indices\" unless it is one patch");
    return std::nullopt;
  }
  if (order.size() % 4 != 0) {
    params.bad_value("indices", "has " + std::to_string(order.size()) + " numbers; it needs 4 per patch");
    return std::nullopt;
  }
  TriangleMesh mesh;
  for (size_t i = 0; i < order.size(); i += 4) {
    std::array<Vec3f, 4> corners;
    for (size_t k = 0; k < 4; ++k) {
      if (order[i + k] < 0 || order[i + k] >= static_cast<double>(count)) {
        params.bad_value("indices", "refers to a vertex that does not exist");
        return std::nullopt;
      }
      const size_t at = 3 * static_cast<size_t>(order[i + k]);
      corners[k] = {static_cast<float>((*positions)[at]), static_cast<float>((*positions)[at + 1]),
                    static_cast<float>((*positions)[at + 2])};
    }
    append_mesh(&mesh, patch_mesh(corners));
  }
  const bool curved = mesh.triangles.size() > order.size() / 2;
  ReadShape shape = as_mesh(std::move(mesh));
  shape.emitters = order.size() / 4;
  if (curved) name_approximation(out, params, "curved bilinear patch", shape);
  return shape;
}

void tessellate_stretched_spheres(SceneDescription* scene, ProblemList* problems) {
  std::shared_ptr<const TriangleMesh> unit;
  for (ShapeDescription& shape : scene->shapes) {
    const auto* sphere = std::get_if<SphereShape>(&shape.kind);
    const bool masked = shape.alpha.texture >= 0 || shape.alpha.value < 1;
    if (sphere == nullptr || (is_similarity(shape.object_to_world) && !masked)) continue;
    if (unit == nullptr)
      unit = std::make_shared<const TriangleMesh>(sphere_mesh(1, -1, 1, 2 * std::numbers::pi));
    const double r = sphere->radius;
    std::string what = "an exact sphere ";
    what += masked ? "with an alpha mask" : "under a non-uniform scale";
    what += "; it is approximated by " + std::to_string(unit->triangles.size()) + " triangles";
    problems->unsupported(shape.location, what);
    shape.object_to_world = shape.object_to_world * scaling({r, r, r});
    shape.kind = MeshShape{unit};
  }
}

}  // namespace lightmill
