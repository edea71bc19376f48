// Directives of pbrt-v4 that define objects and place their instances.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "common/scene/pbrt/parser.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr size_t kMaxInstances = 8'000'000;  // about 1 GB here, and as much in the renderer

/// Corners of the box around `shapes` at both ends of their ways; none around nothing.
std::vector<Vec3d> box_corners(const std::vector<ShapeDescription>& shapes,
                               const std::vector<Transform>& later) {
  std::array<double, 3> lo, hi;
  lo.fill(1e300), hi.fill(-1e300);
  const auto add = [&](const Transform& t, const Vec3d& p) {
    const Vec3d q = transform_point(t, p);
    const std::array<double, 3> c{q.x, q.y, q.z};
    for (size_t i = 0; i < 3; ++i) lo[i] = std::min(lo[i], c[i]), hi[i] = std::max(hi[i], c[i]);
  };
  const auto add_shape = [&](const ShapeDescription& s, const Transform& t) {
    if (const auto* sphere = std::get_if<SphereShape>(&s.kind)) {
      const double r = sphere->radius;
      for (const double x : {-r, r}) {
        for (const double y : {-r, r}) {
          for (const double z : {-r, r}) add(t, {x, y, z});
        }
      }
    } else {
      for (const Vec3f& p : std::get<MeshShape>(s.kind).mesh->positions) add(t, {p.x, p.y, p.z});
    }
  };
  for (const ShapeDescription& s : shapes) {
    add_shape(s, s.object_to_world);
    if (s.moves_to >= 0) add_shape(s, later[static_cast<size_t>(s.moves_to)]);
  }
  std::vector<Vec3d> corners;
  if (lo[0] > hi[0]) return corners;
  for (const double x : {lo[0], hi[0]}) {
    for (const double y : {lo[1], hi[1]}) {
      for (const double z : {lo[2], hi[2]}) corners.push_back({x, y, z});
    }
  }
  return corners;
}

}  // namespace

void PbrtParser::on_object_begin(const Token& d) {
  if (!require_world(d)) return;
  const auto name = take_string(d, "a name");
  if (!name) return;
  if (open_object_) {
    problems_->error(d.where.location(), "ObjectBegin inside of another object");
    return;
  }
  if (objects_.contains(*name)) {
    const std::string message = "the object " + in_quotes(*name) + " is defined twice; ";
    if (out_.dialect == Dialect::kV4) {
      problems_->error(d.where.location(), message + "rename one");
      return;
    }
    problems_->warning(d.where.location(), message + "this one holds from here on");
  }
  push(Scope::Kind::kObject, d);
  open_object_ = *name;
  out_.object_files.emplace();
  out_.open_curves.reset();
  object_first_shape_ = out_.scene.shapes.size();
}

void PbrtParser::on_object_end(const Token& d) {
  if (!require_world(d)) return;
  if (!open_object_) {
    misplaced(d.where.location(), "ObjectEnd without ObjectBegin");
    return;
  }
  if (!pop(Scope::Kind::kObject, d, "ObjectBegin") && out_.dialect == Dialect::kV4) return;
  auto& shapes = out_.scene.shapes;
  const auto first = shapes.begin() + static_cast<std::ptrdiff_t>(object_first_shape_);
  ObjectDescription object{*open_object_,
                           {std::make_move_iterator(first), std::make_move_iterator(shapes.end())}};
  shapes.erase(first, shapes.end());
  objects_[*open_object_] = {static_cast<int>(out_.scene.objects.size()),
                             box_corners(object.shapes, out_.scene.later), std::move(*out_.object_files)};
  out_.object_files.reset();
  out_.scene.objects.push_back(std::move(object));
  out_.open_curves.reset();
  open_object_.reset();
}

void PbrtParser::on_object_instance(const Token& d) {
  if (!require_world(d)) return;
  const auto name = take_string(d, "a name");
  if (!name) return;
  ParameterList params = take_parameters(d, "the instance of " + in_quotes(*name), "shape");
  const RayKinds hidden = hidden_from(params);
  const PartNames names = part_names_from(params, &out_.scene);
  params.finish();
  if (open_object_) {
    misplaced(d.where.location(), "ObjectInstance inside of an object");
    return;
  }
  const auto found = objects_.find(*name);
  if (found == objects_.end()) {
    std::vector<std::string_view> names;
    for (const auto& [known, shapes] : objects_) names.push_back(known);
    misplaced(d.where.location(),
              "there is no object named " + in_quotes(*name) + nearest_hint(*name, names));
    return;
  }
  if (refuse_if_flat()) return;
  if (out_.scene.instances.size() >= kMaxInstances) {
    problems_->error(d.where.location(), "the scene has more than 8000000 instances, which is the limit");
    return;
  }
  // Both are in range and not singular: see apply().
  const Transform &ctm = state_.shape.ctm, &end = state_.ctm_end;
  constexpr double kLimit = 1e37;  // as for shapes
  const auto fits = [](const Vec3d& p) {
    return std::abs(p.x) < kLimit && std::abs(p.y) < kLimit && std::abs(p.z) < kLimit;
  };
  for (const Vec3d& corner : found->second.corners) {
    if (fits(transform_point(ctm, corner)) && fits(transform_point(end, corner))) continue;
    problems_->error(d.where.location(), "the instance of " + in_quotes(*name) +
                                             " lies outside the range of numbers; check its transform");
    return;
  }
  if (!found->second.files.complete) {
    problems_->error(d.where.location(),
                     "a mesh of the object " + in_quotes(*name) + " is missing; submit the scene again");
    return;
  }
  out_.list(std::exchange(found->second.files.found, {}));
  out_.scene.instances.push_back({found->second.index, moves_to(d, ctm, end), ctm, hidden, names});
}

}  // namespace lightmill
