#pragma once
// Instances as one user geometry: its primitives are the instances' boxes, and a ray that meets one is taken
// into the object's space by our own arithmetic (placement.h) and traced in the object's scene. The library's
// own instances would invert each matrix in float with estimates that differ between CPU vendors, and leave
// their rounding unknown; so the ray offsets' bounds hold, and an instance costs a box and a record.
//
// For accel/*.cc alone, which include the library's header before this one.
#include <vector>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// The context of every trace: what the callbacks of an object's geometries ask for.
struct TraceContext {
  RTCIntersectContext base;  // first: the library passes it on by its address
  int32_t instance = -1;     // whose object is being traced, or -1

  explicit TraceContext(int32_t of_instance = -1) : instance(of_instance) {
    rtcInitIntersectContext(&base);
    base.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
  static int32_t instance_of(const RTCIntersectContext* context) {
    return reinterpret_cast<const TraceContext*>(context)->instance;
  }
};

/// A built object (or the world): its scene, and the first primitive of each of its geometries.
struct TracedObject {
  RTCScene scene = nullptr;
  std::vector<int32_t> first_primitive;  // per geometry id
};

/// The user data of the geometry of all instances; must outlive it and not move.
struct TracedInstances {
  const RenderScene* scene = nullptr;
  std::vector<TracedObject> objects;
};

/// Attaches the instances to `world`. A hit's instID is the instance, its primID the primitive's number.
void attach_instances(RTCDevice device, RTCScene world, TracedInstances* instances);

}  // namespace lightmill
