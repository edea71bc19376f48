#include "worker/render/scene/scene_extent.h"

#include <algorithm>
#include <cmath>

#include "worker/render/scene/geometry/shape_space.h"

namespace lightmill {
namespace {

struct Bounds {
  double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300};
  void add(const Vec3d& p, double r = 0) {
    const double c[3] = {p.x, p.y, p.z};
    for (int i = 0; i < 3; ++i) {
      lo[i] = std::min(lo[i], c[i] - r);
      hi[i] = std::max(hi[i], c[i] + r);
    }
  }
  bool empty() const { return lo[0] > hi[0]; }
};

void add_shape(const ShapeDescription& s, Bounds* b) {
  if (const auto* mesh = std::get_if<MeshShape>(&s.kind)) {
    for (const Vec3f& v : mesh->mesh->positions) b->add(transform_point(s.object_to_world.m, v.x, v.y, v.z));
  } else {
    b->add(transform_point(s.object_to_world.m, 0, 0, 0),
           sphere_scale(s) * std::get<SphereShape>(s.kind).radius);
  }
}

void add_instances(const SplitScene& split, Bounds* b) {
  for (const InstancedObject& o : split.objects) {
    for (const ShapeDescription* s : o.shapes) {
      if (std::holds_alternative<SphereShape>(s->kind)) sphere_scale(*s);
    }
  }
  for (const PlacedObject& i : split.instances) {
    const InstancedObject& o = split.objects[i.object];
    const auto add_at = [&](const Transform& t) {
      for (int corner = 0; corner < 8; ++corner) {
        b->add(transform_point(t.m, corner & 1 ? o.hi[0] : o.lo[0], corner & 2 ? o.hi[1] : o.lo[1],
                               corner & 4 ? o.hi[2] : o.lo[2]));
      }
    };
    if (i.way < 0) {
      add_at(*i.object_to_world);
    } else {
      for (const Transform& t : split.ways[static_cast<size_t>(i.way)]) add_at(t);
    }
  }
}

void add_light_origin(const LightDescription& l, Bounds* b) {
  const auto add_around = [&](const Vec3d& p, double x, double y, double z) {
    for (const double sign : {-1.0, 1.0}) b->add({p.x + sign * x, p.y + sign * y, p.z + sign * z});
  };
  if (const auto* p = std::get_if<PointLight>(&l.kind))
    add_around(p->position, p->radius, p->radius, p->radius);
  if (const auto* p = std::get_if<SpotLight>(&l.kind))
    add_around(p->position, p->radius, p->radius, p->radius);
  if (const auto* p = std::get_if<AreaLamp>(&l.kind)) {
    for (const double sign : {-1.0, 1.0}) {
      for (const double x : {-1.0, 1.0})
        b->add(transform_point(p->light_to_world.m, x * p->half_width, sign * p->half_height, 0));
    }
  }
  const auto origin = [](const Transform& t) { return Vec3d{t.m[0][3], t.m[1][3], t.m[2][3]}; };
  if (const auto* p = std::get_if<GoniometricLight>(&l.kind)) b->add(origin(p->light_to_world));
  if (const auto* p = std::get_if<ProjectionLight>(&l.kind)) b->add(origin(p->light_to_world));
}

}  // namespace

SceneExtent measure_extent(const std::vector<const ShapeDescription*>& world, const SplitScene& split,
                           const std::vector<LightDescription>& lights, const Vec3d& origin,
                           const std::vector<Vec3d>& also) {
  Bounds b;
  for (const ShapeDescription* shape : world) add_shape(*shape, &b);
  add_instances(split, &b);
  for (const LightDescription& l : lights) add_light_origin(l, &b);
  for (const Vec3d& p : also) b.add(p);
  const double from[3] = {origin.x, origin.y, origin.z};
  double extent = 0;
  if (!b.empty()) {
    for (int i = 0; i < 3; ++i)
      extent = std::max({extent, std::fabs(b.lo[i] - from[i]), std::fabs(b.hi[i] - from[i])});
  }
  if (!std::isfinite(extent))
    throw Error(ErrorKind::kBadScene, "the scene's extent is not finite; check its transforms");
  SceneExtent result;
  result.scale_exponent = extent > 0 ? -std::ilogb(extent) : 0;
  result.empty = b.empty();
  if (result.empty) return result;
  const double s = std::ldexp(1.0, result.scale_exponent);
  double r2 = 0;
  for (int i = 0; i < 3; ++i) {
    result.center[i] = static_cast<float>((0.5 * (b.lo[i] + b.hi[i]) - from[i]) * s);
    const double half = 0.5 * (b.hi[i] - b.lo[i]) * s;
    r2 += half * half;
  }
  result.radius = static_cast<float>(std::max(std::sqrt(r2) * 1.001, 1e-6));
  return result;
}

}  // namespace lightmill
