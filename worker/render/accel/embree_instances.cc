#include <embree3/rtcore.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "worker/render/accel/accel.h"
#include "worker/render/accel/traced_instances.h"
#include "worker/render/scene/geometry/placement.h"

namespace lightmill {
namespace {

constexpr unsigned kMaxLanes = 8;  // of the packets that accel.h traces

const TracedObject& object_of(const TracedInstances& all, int32_t instance) {
  return all.objects[static_cast<size_t>(all.scene->instance_object[static_cast<size_t>(instance)])];
}

struct Box {
  double lo[3], hi[3];
  double slack[3];  // what rounding may move a ray by on its way in, and then some
};

/// Of an object at a record.
Box box_at(const ObjectRange& o, const float* r) {
  Box b;
  const double scale = 1.0 / double{r[kInstanceTimeScale]};
  for (size_t i = 0; i < 3; ++i) {
    b.lo[i] = b.hi[i] = double{r[kInstancePosition + i]};
    double size = 0;
    for (size_t j = 0; j < 3; ++j) {
      const double a = double{r[kInstanceA + 3 * i + j]} * scale;
      b.lo[i] += std::min(a * double{o.lo[j]}, a * double{o.hi[j]});
      b.hi[i] += std::max(a * double{o.lo[j]}, a * double{o.hi[j]});
      size += std::fabs(a) * double{std::max(std::fabs(o.lo[j]), std::fabs(o.hi[j]))};
    }
    // A box that is a little larger costs nothing.
    b.slack[i] = 0x1p-20 * (double{r[kInstanceSpread]} * size + std::fabs(double{r[kInstancePosition + i]}));
  }
  return b;
}

/// Time steps are poses; the library goes from one's box to the next one's as we go from pose to pose.
void instance_bounds(const RTCBoundsFunctionArguments* args) {
  const auto& geometry = *static_cast<const InstanceGeometry*>(args->geometryUserPtr);
  const RenderScene& scene = *geometry.all->scene;
  const int32_t instance = geometry.instance(args->primID);
  const auto i = static_cast<size_t>(instance);
  const ObjectRange& o = scene.objects[static_cast<size_t>(scene.instance_object[i])];
  Box box;
  if (instance < scene.first_moving) {
    box = box_at(o, &scene.instance_records[i * kInstanceFloats]);
  } else {
    const auto at = [&](int32_t pose) {
      float record[kInstanceFloats];
      pose_record(scene, instance, pose, 0, record);
      return box_at(o, record);
    };
    const int32_t last = scene.ways[i - static_cast<size_t>(scene.first_moving)].segments;
    const auto step = static_cast<int32_t>(args->timeStep);
    box = at(step);
    // Between two poses things are rounded as at either.
    for (const int32_t next : {std::max(step - 1, 0), std::min(step + 1, last)}) {
      const Box other = at(next);
      for (size_t k = 0; k < 3; ++k) box.slack[k] = std::max(box.slack[k], 2 * other.slack[k]);
    }
  }
  const auto down = [](double x) { return std::nextafter(static_cast<float>(x), -kInfinity); };
  const auto up = [](double x) { return std::nextafter(static_cast<float>(x), kInfinity); };
  auto& b = *args->bounds_o;
  b.lower_x = down(box.lo[0] - box.slack[0]), b.upper_x = up(box.hi[0] + box.slack[0]);
  b.lower_y = down(box.lo[1] - box.slack[1]), b.upper_y = up(box.hi[1] + box.slack[1]);
  b.lower_z = down(box.lo[2] - box.slack[2]), b.upper_z = up(box.hi[2] + box.slack[2]);
}

/// The valid rays of a packet in the object's space.
struct ObjectRays {
  unsigned lanes = 0;  // bits; if there are none, nothing else is set
  alignas(32) float ox[kMaxLanes], oy[kMaxLanes], oz[kMaxLanes], dx[kMaxLanes], dy[kMaxLanes], dz[kMaxLanes];
  alignas(32) float tnear[kMaxLanes], tfar[kMaxLanes], time[kMaxLanes];
  unsigned id[kMaxLanes];
  RayKinds kinds[kMaxLanes] = {};
  float time_scale;

  ObjectRays(const RenderScene& scene, int32_t instance, const int* valid, RTCRayN* ray, unsigned n) {
    alignas(32) float o[3][kMaxLanes], d[3][kMaxLanes];
    unsigned some = 0;
    const RayKinds hidden =
        scene.instance_hidden.empty() ? 0 : scene.instance_hidden[static_cast<size_t>(instance)];
    for (unsigned i = 0; i < n; ++i) {
      if (!valid[i]) continue;
      const auto of_ray = static_cast<RayKinds>(RTCRayN_mask(ray, n, i));
      if (hidden != 0 && is_hidden(hidden, of_ray)) continue;
      kinds[i] = of_ray;
      lanes |= 1u << i;
      some = i;
    }
    if (lanes == 0) return;
    for (unsigned l = 0; l < kMaxLanes; ++l) time[l] = RTCRayN_time(ray, n, lanes >> l & 1 ? l : some);
    const auto place = Placement<Float8>::of(scene, instance, load<Float8>(time), lanes);
    const float t = time_scale =
        scene.instance_records[static_cast<size_t>(instance) * kInstanceFloats + kInstanceTimeScale];
    for (unsigned l = 0; l < kMaxLanes; ++l) {
      const unsigned i = lanes >> l & 1 ? l : some;
      o[0][l] = RTCRayN_org_x(ray, n, i), o[1][l] = RTCRayN_org_y(ray, n, i),
      o[2][l] = RTCRayN_org_z(ray, n, i);
      d[0][l] = RTCRayN_dir_x(ray, n, i), d[1][l] = RTCRayN_dir_y(ray, n, i),
      d[2][l] = RTCRayN_dir_z(ray, n, i);
      tnear[l] = RTCRayN_tnear(ray, n, i) * t;
      tfar[l] = RTCRayN_tfar(ray, n, i) * t;
      id[l] = RTCRayN_id(ray, n, i);
    }
    const Vec3<Float8> po = place.origin({load<Float8>(o[0]), load<Float8>(o[1]), load<Float8>(o[2])});
    const Vec3<Float8> pd = place.direction({load<Float8>(d[0]), load<Float8>(d[1]), load<Float8>(d[2])});
    store(ox, po.x), store(oy, po.y), store(oz, po.z);
    store(dx, pd.x), store(dy, pd.y), store(dz, pd.z);
  }
  /// If just one ray is valid: which.
  int single() const { return std::has_single_bit(lanes) ? std::countr_zero(lanes) : -1; }
  void fill(unsigned l, RTCRay* r) const {
    r->org_x = ox[l], r->org_y = oy[l], r->org_z = oz[l];
    r->dir_x = dx[l], r->dir_y = dy[l], r->dir_z = dz[l];
    r->tnear = tnear[l], r->tfar = tfar[l];
    r->time = time[l], r->mask = kinds[l], r->id = id[l], r->flags = 0;
  }
  void fill(RTCRay8* r, int* valid) const {
    for (unsigned l = 0; l < kMaxLanes; ++l) {
      valid[l] = lanes >> l & 1 ? -1 : 0;
      r->org_x[l] = ox[l], r->org_y[l] = oy[l], r->org_z[l] = oz[l];
      r->dir_x[l] = dx[l], r->dir_y[l] = dy[l], r->dir_z[l] = dz[l];
      r->tnear[l] = tnear[l], r->tfar[l] = tfar[l];
      r->time[l] = time[l], r->mask[l] = kinds[l], r->id[l] = id[l], r->flags[l] = 0;
    }
  }
};

void instance_intersect(const RTCIntersectFunctionNArguments* args) {
  const auto& geometry = *static_cast<const InstanceGeometry*>(args->geometryUserPtr);
  const TracedInstances& all = *geometry.all;
  const int32_t instance = geometry.instance(args->primID);
  const TracedObject& object = object_of(all, instance);
  const unsigned n = args->N;
  RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, n);
  RTCHitN* hit = RTCRayHitN_HitN(args->rayhit, n);
  const ObjectRays rays(*all.scene, instance, args->valid, ray, n);
  if (rays.lanes == 0) return;
  TraceContext context(instance, nullptr, TraceContext::of(args->context).passed);
  const auto report = [&](unsigned l, float t, unsigned geometry, unsigned prim) {
    if (geometry == RTC_INVALID_GEOMETRY_ID) return;
    RTCRayN_tfar(ray, n, l) = t / rays.time_scale;
    RTCHitN_geomID(hit, n, l) = args->geomID;
    RTCHitN_primID(hit, n, l) = static_cast<unsigned>(object.first_primitive[geometry]) + prim;
    RTCHitN_instID(hit, n, l, 0) = static_cast<unsigned>(instance);
  };
  if (const int l = rays.single(); l >= 0) {
    RTCRayHit one;
    rays.fill(static_cast<unsigned>(l), &one.ray);
    one.hit.geomID = one.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(object.scene, &context.base, &one);
    report(static_cast<unsigned>(l), one.ray.tfar, one.hit.geomID, one.hit.primID);
    return;
  }
  RTCRayHit8 packet;
  alignas(32) int valid[kMaxLanes];
  rays.fill(&packet.ray, valid);
  for (unsigned l = 0; l < kMaxLanes; ++l)
    packet.hit.geomID[l] = packet.hit.instID[0][l] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect8(valid, object.scene, &context.base, &packet);
  for (unsigned bits = rays.lanes; bits; bits &= bits - 1) {
    const auto l = static_cast<unsigned>(std::countr_zero(bits));
    report(l, packet.ray.tfar[l], packet.hit.geomID[l], packet.hit.primID[l]);
  }
}

void instance_occluded(const RTCOccludedFunctionNArguments* args) {
  const auto& geometry = *static_cast<const InstanceGeometry*>(args->geometryUserPtr);
  const TracedInstances& all = *geometry.all;
  const int32_t instance = geometry.instance(args->primID);
  const TracedObject& object = object_of(all, instance);
  const ObjectRays rays(*all.scene, instance, args->valid, args->ray, args->N);
  if (rays.lanes == 0) return;
  TraceContext context(instance, TraceContext::of(args->context).crossed);
  const auto report = [&](unsigned l, float t) {
    if (t < 0) RTCRayN_tfar(args->ray, args->N, l) = -kInfinity;
  };
  if (const int l = rays.single(); l >= 0) {
    RTCRay one;
    rays.fill(static_cast<unsigned>(l), &one);
    rtcOccluded1(object.scene, &context.base, &one);
    report(static_cast<unsigned>(l), one.tfar);
    return;
  }
  RTCRay8 packet;
  alignas(32) int valid[kMaxLanes];
  rays.fill(&packet, valid);
  rtcOccluded8(valid, object.scene, &context.base, &packet);
  for (unsigned bits = rays.lanes; bits; bits &= bits - 1) {
    const auto l = static_cast<unsigned>(std::countr_zero(bits));
    report(l, packet.tfar[l]);
  }
}

}  // namespace

size_t attach_instances(RTCDevice device, RTCScene world, TracedInstances* instances) {
  const RenderScene& scene = *instances->scene;
  const auto attach = [&](size_t count, unsigned time_steps, InstanceGeometry* geometry) {
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(g, static_cast<unsigned>(count));
    if (time_steps > 1) rtcSetGeometryTimeStepCount(g, time_steps);
    rtcSetGeometryUserData(g, geometry);
    rtcSetGeometryBoundsFunction(g, instance_bounds, nullptr);
    rtcSetGeometryIntersectFunction(g, instance_intersect);
    rtcSetGeometryOccludedFunction(g, instance_occluded);
    rtcCommitGeometry(g);
    rtcAttachGeometry(world, g);
    rtcReleaseGeometry(g);
  };
  const auto still = static_cast<size_t>(scene.first_moving);
  if (still > 0) attach(still, 1, &instances->geometries.emplace_back(InstanceGeometry{instances, {}}));
  for (int32_t segments = 1; segments <= kMostSegments; segments *= 2) {
    std::vector<int32_t> moving;
    for (size_t i = 0; i < scene.ways.size(); ++i) {
      if (scene.ways[i].segments == segments) moving.push_back(static_cast<int32_t>(still + i));
    }
    if (moving.empty()) continue;
    InstanceGeometry& g = instances->geometries.emplace_back(InstanceGeometry{instances, std::move(moving)});
    attach(g.moving.size(), static_cast<unsigned>(segments) + 1, &g);
  }
  return instances->geometries.size();
}

}  // namespace lightmill
