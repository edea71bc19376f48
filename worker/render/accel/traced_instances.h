#pragma once
// Instances as user geometry: its primitives are the instances' boxes, and a ray that meets one is taken
// into the object's space by our own arithmetic (placement.h) and traced in the object's scene. The library's
// own instances would invert each matrix in float with estimates that differ between CPU vendors, and leave
// their rounding unknown; so the ray offsets' bounds hold, and an instance costs a box and a record. Those
// that stand still are one geometry; those that move are one for each number of segments of their ways, whose
// time steps are their poses.
//
// For accel/*.cc alone, which include the library's header before this one.
#include <deque>
#include <vector>

#include "worker/render/accel/accel.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// The context of every trace: what the callbacks of an object's geometries ask for.
struct TraceContext {
  RTCIntersectContext base;  // first: the library passes it on by its address
  int32_t instance = -1;     // whose object is being traced, or -1
  /// Of occlusion tests that go on through what light passes straight: bits of the rays' ids that met such.
  /// Null: nothing is passed.
  unsigned* crossed = nullptr;
  const PassedSurfaces* passed = nullptr;  // of closest-hit rays, whose ids are theirs in it; or null

  explicit TraceContext(int32_t of_instance = -1, unsigned* crossed_by = nullptr,
                        const PassedSurfaces* passed_by = nullptr)
      : instance(of_instance), crossed(crossed_by), passed(passed_by) {
    rtcInitIntersectContext(&base);
    base.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
  static const TraceContext& of(const RTCIntersectContext* context) {
    return *reinterpret_cast<const TraceContext*>(context);
  }
};

/// A built object (or the world): its scene, and the first primitive of each of its geometries.
struct TracedObject {
  RTCScene scene = nullptr;
  std::vector<int32_t> first_primitive;  // per geometry id
};

struct TracedInstances;
/// The user data of a geometry of instances.
struct InstanceGeometry {
  const TracedInstances* all = nullptr;
  std::vector<int32_t> moving;  // instance of each of its primitives; empty: their numbers

  int32_t instance(unsigned prim) const { return moving.empty() ? static_cast<int32_t>(prim) : moving[prim]; }
};
/// Must outlive the geometries and not move.
struct TracedInstances {
  const RenderScene* scene = nullptr;
  std::vector<TracedObject> objects;
  std::deque<InstanceGeometry> geometries;
};

/// Attaches the instances to `world`; how many geometries they are. A hit's instID is the instance, its
/// primID the primitive's number.
size_t attach_instances(RTCDevice device, RTCScene world, TracedInstances* instances);

}  // namespace lightmill
