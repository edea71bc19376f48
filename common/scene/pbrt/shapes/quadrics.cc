#include "common/scene/pbrt/shapes/quadrics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/mesh/tessellate.h"
#include "common/scene/pbrt/syntax/params.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// nullopt: reported, as the scene has too many triangles.
std::optional<ReadShape> tessellated(PbrtScene& out, ParameterList& params, TriangleMesh mesh) {
  if (!out.may_generate(mesh.triangles.size(), params)) return std::nullopt;
  return ReadShape{MeshShape{std::make_shared<const TriangleMesh>(std::move(mesh))}, 1};
}

/// A radius above 0, or 0 if the shape is left out (reported).
double read_radius(ParameterList& params) {
  const double given = params.number("radius", 1, -kAnySize, kAnySize), radius = std::abs(given);
  if (given < 0) params.odd_value("radius", "must be above 0; it is taken without its sign");
  if (static_cast<float>(radius) > 0) return radius;
  params.left_out("has a \"radius\" of 0; it must be above 0");
  return 0;
}

double read_phimax(ParameterList& params) {
  const double phi = params.number("phimax", 360, 0, 360);
  if (phi > 0) return phi * kDegree;
  params.odd_value("phimax", "must be above 0; 360 is taken");
  return 2 * std::numbers::pi;
}

/// zmin < zmax after pbrt's reordering; nothing of an empty range, which is reported.
std::optional<std::pair<double, double>> read_range(ParameterList& params, double low, double high) {
  const double a = params.number("zmin", low, -kAnySize, kAnySize),
               b = params.number("zmax", high, -kAnySize, kAnySize);
  if (a != b) return std::pair{std::min(a, b), std::max(a, b)};
  params.left_out("has a \"zmax\" that must differ from \"zmin\"");
  return std::nullopt;
}

/// Puts a mesh of the unit sphere in place of a sphere.
void make_mesh(SceneDescription* scene, ShapeDescription* shape,
               const std::shared_ptr<const TriangleMesh>& unit) {
  const double r = std::get<SphereShape>(shape->kind).radius;
  shape->object_to_world = shape->object_to_world * scaling({r, r, r});
  if (shape->moves_to >= 0) {
    const Transform end = scene->later[static_cast<size_t>(shape->moves_to)] * scaling({r, r, r});
    shape->moves_to = static_cast<int>(scene->later.size());
    scene->later.push_back(end);
  }
  shape->kind = MeshShape{unit};
}

/// Spheres that emit and move become meshes: only those can do both. Each triangle is a light, so there are
/// not many.
void tessellate_moving_emitters(SceneDescription* scene) {
  constexpr int kSegments = 32;  // within 0.7 % of the radius
  std::shared_ptr<const TriangleMesh> unit;
  for (ShapeDescription& shape : scene->shapes) {
    if (shape.area_light < 0 || shape.moves_to < 0 || !std::holds_alternative<SphereShape>(shape.kind))
      continue;
    if (unit == nullptr)
      unit = std::make_shared<const TriangleMesh>(sphere_mesh(1, -1, 1, 2 * std::numbers::pi, kSegments));
    make_mesh(scene, &shape, unit);
  }
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
    params.left_out("has a \"zmin\" and a \"zmax\" that leave nothing of the sphere");
    return std::nullopt;
  }
  return tessellated(out, params,
                     sphere_mesh(r, std::max(range->first, -r), std::min(range->second, r), phimax));
}

std::optional<ReadShape> read_disk(PbrtScene& out, ParameterList& params) {
  const double height = params.number("height", 0, -kAnySize, kAnySize);
  const double r = read_radius(params);
  const double inner = params.number("innerradius", 0, 0, kAnySize);
  const double phimax = read_phimax(params);
  if (r == 0) return std::nullopt;
  if (inner >= r) {
    params.left_out("has an \"innerradius\" that must be below \"radius\"");
    return std::nullopt;
  }
  return tessellated(out, params, disk_mesh(height, r, inner, phimax));
}

std::optional<ReadShape> read_cylinder(PbrtScene& out, ParameterList& params) {
  const double r = read_radius(params);
  const auto range = read_range(params, -1, 1);
  const double phimax = read_phimax(params);
  if (r == 0 || !range) return std::nullopt;
  return tessellated(out, params, cylinder_mesh(r, range->first, range->second, phimax));
}

void tessellate_spheres(SceneDescription* scene, ProblemList* problems) {
  tessellate_moving_emitters(scene);
  constexpr size_t kBudget = 8'000'000;  // triangles of all of them
  constexpr int kFineSegments = 64;      // within 0.2 % of the radius: half a pixel of a sphere of 600
  std::vector<ShapeDescription*> found;
  const auto is_round = [&](const Transform& start, int moves_to) {
    return is_similarity(start) &&
           (moves_to < 0 || is_similarity(scene->later[static_cast<size_t>(moves_to)]));
  };
  const auto find = [&](std::vector<ShapeDescription>& shapes, bool stretched) {
    for (ShapeDescription& shape : shapes) {
      if (!std::holds_alternative<SphereShape>(shape.kind)) continue;
      // An emitter of alpha 0 is there for no ray: it needs no mesh to be masked.
      const bool masked = shape.alpha.texture >= 0 ||
                          (shape.alpha.value < 1 && !(shape.alpha.value == 0 && shape.area_light >= 0));
      if (stretched || masked || !is_round(shape.object_to_world, shape.moves_to)) found.push_back(&shape);
    }
  };
  find(scene->shapes, false);
  std::vector<bool> stretched(scene->objects.size(), false);
  for (const InstanceDescription& i : scene->instances) {
    const auto object = static_cast<size_t>(i.object);
    if (!stretched[object]) stretched[object] = !is_round(i.object_to_world, i.moves_to);
  }
  for (size_t i = 0; i < scene->objects.size(); ++i) find(scene->objects[i].shapes, stretched[i]);
  if (found.empty()) return;
  int segments = kSphereSegments;
  const auto triangles = [&] { return static_cast<size_t>(segments) * static_cast<size_t>(segments); };
  while (segments > 16 && found.size() * triangles() > kBudget) segments /= 2;
  if (found.size() * triangles() > 16 * kBudget) {
    problems->error(found.front()->location,
                    "the scene has " + std::to_string(found.size()) +
                        " spheres under a non-uniform scale, which are too many; use fewer, or round ones");
    return;
  }
  if (segments < kFineSegments) {
    problems->warning(found.front()->location, "the scene has " + std::to_string(found.size()) +
                                                   " spheres under a non-uniform scale; each is drawn as " +
                                                   std::to_string(triangles()) + " triangles, within " +
                                                   std::to_string(700 / (segments * segments) + 1) +
                                                   " % of its radius");
  }
  const auto unit =
      std::make_shared<const TriangleMesh>(sphere_mesh(1, -1, 1, 2 * std::numbers::pi, segments));
  for (ShapeDescription* shape : found) make_mesh(scene, shape, unit);
}

}  // namespace lightmill
