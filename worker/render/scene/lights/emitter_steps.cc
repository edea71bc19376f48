#include "worker/render/scene/lights/emitter_steps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/scene/transform.h"
#include "worker/render/scene/geometry/instance_pose.h"

namespace lightmill {
namespace {

/// A vertex of the emitter in its object's space at `time`.
Vec3d in_object(const RenderScene& scene, const ObjectEmitter& e, size_t corner, double time) {
  const double at = time * e.bend.segments;
  const int32_t step = std::min(static_cast<int32_t>(at), e.bend.segments - 1);
  const double f = at - step;
  const float* a = &scene.positions[static_cast<size_t>(e.vertices[corner] + step * e.bend.vertices) * 3];
  const float* b = a + static_cast<size_t>(e.bend.vertices) * 3;
  const auto between = [&](size_t i) { return double{a[i]} + (double{b[i]} - double{a[i]}) * f; };
  return {between(0), between(1), between(2)};
}

Vec3d in_scene(const float* record, const Vec3d& p) {
  const double scale = 1 / double{record[kInstanceTimeScale]};
  const auto row = [&](size_t i) {
    const float* a = record + kInstanceA + 3 * i;
    return (a[0] * p.x + a[1] * p.y + a[2] * p.z) * scale + double{record[kInstancePosition + i]};
  };
  return {row(0), row(1), row(2)};
}

Vec3d between(const Vec3d& from, const Vec3d& to) { return {to.x - from.x, to.y - from.y, to.z - from.z}; }

}  // namespace

std::vector<float> emitter_steps(const RenderScene& scene, const ObjectEmitter& e, int32_t instance) {
  const int32_t way = scene.ways[static_cast<size_t>(instance - scene.first_moving)].segments;
  const int32_t segments = std::max(way, e.bend.segments);
  // Which side of the winding shines: as the record has it, in the object's space.
  const Vec3d p0 = in_object(scene, e, 0, 0);
  const Vec3d winding = cross(between(p0, in_object(scene, e, 1, 0)), between(p0, in_object(scene, e, 2, 0)));
  const float* n = &scene.lights.records[static_cast<size_t>(e.light) * kLightFloats + kLightN];
  const double side = n[0] * winding.x + n[1] * winding.y + n[2] * winding.z < 0 ? -1 : 1;
  std::vector<float> steps;
  for (int32_t k = 0; k <= segments; ++k) {
    const double time = static_cast<double>(k) / segments;
    float record[kInstanceFloats];
    record_at(scene, instance, static_cast<float>(time), record);
    std::array<Vec3d, 3> p;
    for (size_t corner = 0; corner < 3; ++corner)
      p[corner] = in_scene(record, in_object(scene, e, corner, time));
    const Vec3d e1 = between(p[0], p[1]), e2 = between(p[0], p[2]);
    const Vec3d across = cross(e1, e2);
    const double size = length(across);
    // A winding that is mirrored with the object keeps its side in the object.
    const double f = size > 0 ? side * double{record[kInstanceHandedness]} / size : 0;
    for (const Vec3d& v : {p[0], e1, e2, Vec3d{across.x * f, across.y * f, across.z * f}}) {
      for (const double x : {v.x, v.y, v.z}) steps.push_back(static_cast<float>(x));
    }
  }
  return steps;
}

}  // namespace lightmill
