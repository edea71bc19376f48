#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <string>

#include "common/base/error.h"
#include "worker/render/accel/accel.h"
#include "worker/render/accel/few_primitives.h"
#include "worker/render/accel/traced_instances.h"
#include "worker/render/scene/geometry/alpha_mask.h"
#include "worker/render/scene/geometry/sphere_hit.h"

namespace lightmill {
namespace {

constexpr int kPacket = 8;

/// The user data of a geometry of spheres.
struct SphereSet {
  const RenderScene* scene;
  int32_t first;
};
const float* sphere_of(void* user_data, unsigned prim) {
  const auto* set = static_cast<const SphereSet*>(user_data);
  return &set->scene->spheres[(static_cast<size_t>(set->first) + prim) * 4];
}

/// Whether an occlusion test goes on through what the ray has met; then that is noted.
bool passes(const RTCIntersectContext* context, const RenderScene& scene, int32_t prim, unsigned ray) {
  unsigned* crossed = TraceContext::of(context).crossed;
  if (!crossed || !scene.is_passed(prim)) return false;
  *crossed |= 1u << ray;
  return true;
}

/// Whether something that is `hidden` from some rays is so from the one in lane `i` of `n`. Kinds are the
/// library's masks of rays, which it may be built to ignore; so its geometries have none.
bool hides(RayKinds hidden, RTCRayN* ray, unsigned n, unsigned i) {
  return hidden != 0 && is_hidden(hidden, static_cast<RayKinds>(RTCRayN_mask(ray, n, i)));
}
RayKinds hidden_sphere(const void* user_data, unsigned prim) {
  const auto& set = *static_cast<const SphereSet*>(user_data);
  const std::vector<RayKinds>& hidden = set.scene->sphere_hidden;
  return hidden.empty() ? 0 : hidden[static_cast<size_t>(set.first) + prim];
}

void sphere_bounds(const RTCBoundsFunctionArguments* args) {
  const float* s = sphere_of(args->geometryUserPtr, args->primID);
  // One ulp of slack: the box must hold the rounded sphere.
  const float r = s[3] * (1 + 0x1p-22f);
  auto& b = *args->bounds_o;
  auto down = [](float x) { return std::nextafter(x, -std::numeric_limits<float>::infinity()); };
  auto up = [](float x) { return std::nextafter(x, std::numeric_limits<float>::infinity()); };
  b.lower_x = down(s[0] - r), b.lower_y = down(s[1] - r), b.lower_z = down(s[2] - r);
  b.upper_x = up(s[0] + r), b.upper_y = up(s[1] + r), b.upper_z = up(s[2] + r);
}

void sphere_intersect(const RTCIntersectFunctionNArguments* args) {
  const float* s = sphere_of(args->geometryUserPtr, args->primID);
  RTCRayN* ray = RTCRayHitN_RayN(args->rayhit, args->N);
  RTCHitN* hit = RTCRayHitN_HitN(args->rayhit, args->N);
  const RayKinds hidden = hidden_sphere(args->geometryUserPtr, args->primID);
  for (unsigned i = 0; i < args->N; ++i) {
    if (!args->valid[i] || hides(hidden, ray, args->N, i)) continue;
    const float o[3] = {RTCRayN_org_x(ray, args->N, i), RTCRayN_org_y(ray, args->N, i),
                        RTCRayN_org_z(ray, args->N, i)};
    const float d[3] = {RTCRayN_dir_x(ray, args->N, i), RTCRayN_dir_y(ray, args->N, i),
                        RTCRayN_dir_z(ray, args->N, i)};
    const double t = sphere_hit(o, d, s, RTCRayN_tnear(ray, args->N, i), RTCRayN_tfar(ray, args->N, i));
    if (t < 0) continue;
    RTCRayN_tfar(ray, args->N, i) = static_cast<float>(t);
    RTCHitN_geomID(hit, args->N, i) = args->geomID;
    RTCHitN_primID(hit, args->N, i) = args->primID;
    RTCHitN_instID(hit, args->N, i, 0) = args->context->instID[0];
  }
}

void sphere_occluded(const RTCOccludedFunctionNArguments* args) {
  const auto& set = *static_cast<const SphereSet*>(args->geometryUserPtr);
  const float* s = sphere_of(args->geometryUserPtr, args->primID);
  const int32_t prim = set.scene->triangle_count() + set.first + static_cast<int32_t>(args->primID);
  const RayKinds hidden = hidden_sphere(args->geometryUserPtr, args->primID);
  for (unsigned i = 0; i < args->N; ++i) {
    RTCRayN* ray = args->ray;
    if (!args->valid[i] || hides(hidden, ray, args->N, i)) continue;
    const float o[3] = {RTCRayN_org_x(ray, args->N, i), RTCRayN_org_y(ray, args->N, i),
                        RTCRayN_org_z(ray, args->N, i)};
    const float d[3] = {RTCRayN_dir_x(ray, args->N, i), RTCRayN_dir_y(ray, args->N, i),
                        RTCRayN_dir_z(ray, args->N, i)};
    if (sphere_hit(o, d, s, RTCRayN_tnear(ray, args->N, i), RTCRayN_tfar(ray, args->N, i)) >= 0 &&
        !passes(args->context, *set.scene, prim, RTCRayN_id(ray, args->N, i))) {
      RTCRayN_tfar(ray, args->N, i) = -std::numeric_limits<float>::infinity();
    }
  }
}

/// A mesh with hits that do not count, as it has an alpha mask, is hidden, of fibres or passed straight; its
/// geometry's user data.
struct FilteredMesh {
  const RenderScene* scene;
  const MeshRange* mesh;
};

/// Whether a ray that meets a surface of alpha `a` goes on; it stops where its caller is to decide.
bool passes_alpha(const TraceContext& context, size_t ray, float a, int32_t prim, const Vec3<float>& o,
                  const Vec3<float>& d) {
  const PassedSurfaces* passed = context.passed;
  if (!passed) return !alpha_stops(a, prim, context.instance, o, d);
  if (passed->holds(ray, prim, context.instance)) return true;
  return passed->full(ray) ? !alpha_stops(a, prim, context.instance, o, d) : !(a > 0);
}

/// Rejects the hits that alpha, the back of a fibre or the kind of the ray lets through, of closest-hit and
/// shadow rays alike.
template <bool kShadow>
void alpha_filter(const RTCFilterFunctionNArguments* args) {
  const auto* masked = static_cast<const FilteredMesh*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i) {
    if (!args->valid[i]) continue;
    const Vec3<float> o{RTCRayN_org_x(args->ray, args->N, i), RTCRayN_org_y(args->ray, args->N, i),
                        RTCRayN_org_z(args->ray, args->N, i)};
    const Vec3<float> d{RTCRayN_dir_x(args->ray, args->N, i), RTCRayN_dir_y(args->ray, args->N, i),
                        RTCRayN_dir_z(args->ray, args->N, i)};
    const auto prim = static_cast<int32_t>(RTCHitN_primID(args->hit, args->N, i));
    const MeshRange& mesh = *masked->mesh;
    if (hides(mesh.hidden, args->ray, args->N, i)) {
      args->valid[i] = 0;
      continue;
    }
    if (mesh.fibres != 0 && meets_back(*masked->scene, mesh.first_triangle + prim, mesh.fibres, d)) {
      args->valid[i] = 0;
      continue;
    }
    if (!has_alpha_mask(mesh.alpha)) continue;
    const TraceContext& context = TraceContext::of(args->context);
    const float a = alpha_at(*masked->scene, mesh.alpha, mesh.first_triangle + prim, context.instance,
                             RTCRayN_time(args->ray, args->N, i), o, d, kShadow);
    if (passes_alpha(context, RTCRayN_id(args->ray, args->N, i), a, mesh.first_triangle + prim, o, d))
      args->valid[i] = 0;
  }
}

/// Rejects the hits that occlusion tests go on through.
void straight_filter(const RTCFilterFunctionNArguments* args) {
  const auto& mesh = *static_cast<const FilteredMesh*>(args->geometryUserPtr);
  for (unsigned i = 0; i < args->N; ++i) {
    if (!args->valid[i]) continue;
    const int32_t prim =
        mesh.mesh->first_triangle + static_cast<int32_t>(RTCHitN_primID(args->hit, args->N, i));
    if (passes(args->context, *mesh.scene, prim, RTCRayN_id(args->ray, args->N, i))) args->valid[i] = 0;
  }
}
void alpha_and_straight_filter(const RTCFilterFunctionNArguments* args) {
  alpha_filter<true>(args);
  straight_filter(args);
}

[[noreturn]] void fail(RTCDevice device) {
  const char* what = "unknown";
  switch (rtcGetDeviceError(device)) {
    case RTC_ERROR_OUT_OF_MEMORY:
      what = "out of memory";
      break;
    case RTC_ERROR_UNSUPPORTED_CPU:
      what = "this CPU has no AVX2";
      break;
    case RTC_ERROR_INVALID_ARGUMENT:
    case RTC_ERROR_INVALID_OPERATION:
      what = "invalid geometry";
      break;
    default:
      break;
  }
  throw Error(ErrorKind::kFailed, std::string("the ray tracing structure can't be built: ") + what);
}

}  // namespace

bool PassedSurfaces::holds(size_t ray, int32_t prim, int32_t instance) const {
  const OfRay& r = of[ray];
  for (int i = 0; i < r.count; ++i) {
    if (r.prim[i] == prim && r.instance[i] == instance) return true;
  }
  return false;
}

void PassedSurfaces::add(size_t ray, int32_t prim, int32_t instance) {
  OfRay& r = of[ray];
  r.prim[r.count] = prim;
  r.instance[r.count++] = instance;
}

/// Keeps the count of a device's memory; called by any of its threads.
bool count_bytes(void* counter, ssize_t bytes, bool /*after*/) {
  static_cast<std::atomic<int64_t>*>(counter)->fetch_add(bytes, std::memory_order_relaxed);
  return true;
}

struct Accel::Impl {
  std::atomic<int64_t> bytes{0};
  std::optional<FewPrimitives> few;  // then nothing else is built
  RTCDevice device = nullptr;
  TracedObject world;
  TracedInstances instances;
  std::deque<FilteredMesh> filtered;  // they do not move: geometries point to them
  std::deque<SphereSet> spheres;
  ~Impl() {
    if (world.scene) rtcReleaseScene(world.scene);
    for (const TracedObject& o : instances.objects) rtcReleaseScene(o.scene);
    if (device) rtcReleaseDevice(device);
  }

  TracedObject begin() const {
    TracedObject o{rtcNewScene(device), {}};
    rtcSetSceneFlags(o.scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(o.scene, RTC_BUILD_QUALITY_MEDIUM);
    return o;
  }

  static void attach(RTCGeometry g, int32_t first_primitive, TracedObject* o) {
    rtcCommitGeometry(g);
    rtcAttachGeometry(o->scene, g);
    rtcReleaseGeometry(g);
    o->first_primitive.push_back(first_primitive);
  }

  void add_meshes(const RenderScene& scene, size_t first, size_t count, TracedObject* o) {
    const size_t vertices = (scene.positions.size() - 4) / 3;
    for (size_t i = first; i < first + count; ++i) {
      const MeshRange& mesh = scene.meshes[i];
      RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
      const MeshBend bend = scene.any_bending() ? scene.bends[static_cast<size_t>(mesh.bend)] : MeshBend{};
      const size_t steps = bend.vertices > 0 ? static_cast<size_t>(bend.segments) + 1 : 1,
                   block = static_cast<size_t>(bend.vertices);
      if (steps > 1) rtcSetGeometryTimeStepCount(g, static_cast<unsigned>(steps));
      for (size_t step = 0; step < steps; ++step) {
        rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, static_cast<unsigned>(step), RTC_FORMAT_FLOAT3,
                                   scene.positions.data(), step * block * 12, 12,
                                   vertices - (steps - 1) * block);
      }
      rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, scene.indices.data(),
                                 static_cast<size_t>(mesh.first_triangle) * 12, 12,
                                 static_cast<size_t>(mesh.triangle_count));
      const bool masked =
          has_alpha_mask(mesh.alpha) || mesh.fibres != 0 || mesh.hidden != 0 || scene.overrides & kAlphaMasks;
      bool straight = false;
      for (int32_t t = 0; t < mesh.triangle_count; ++t) straight |= scene.is_passed(mesh.first_triangle + t);
      if (masked || straight) rtcSetGeometryUserData(g, &filtered.emplace_back(FilteredMesh{&scene, &mesh}));
      if (masked) rtcSetGeometryIntersectFilterFunction(g, alpha_filter<false>);
      if (masked && straight) {
        rtcSetGeometryOccludedFilterFunction(g, alpha_and_straight_filter);
      } else if (masked || straight) {
        rtcSetGeometryOccludedFilterFunction(g, masked ? alpha_filter<true> : straight_filter);
      }
      attach(g, mesh.first_triangle, o);
    }
  }

  void add_spheres(const RenderScene& scene, int32_t first, int32_t count, TracedObject* o) {
    if (count == 0) return;
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(g, static_cast<unsigned>(count));
    rtcSetGeometryUserData(g, &spheres.emplace_back(SphereSet{&scene, first}));
    rtcSetGeometryBoundsFunction(g, sphere_bounds, nullptr);
    rtcSetGeometryIntersectFunction(g, sphere_intersect);
    rtcSetGeometryOccludedFunction(g, sphere_occluded);
    attach(g, scene.triangle_count() + first, o);
  }
};

Accel::Accel(const RenderScene& scene, int threads, Structure structure) : impl_(std::make_unique<Impl>()) {
  if (structure == Structure::kFastest && FewPrimitives::suits(scene)) {
    impl_->few.emplace(scene);
    return;
  }
  const std::string config = "isa=avx2,frequency_level=simd256" +
                             (threads > 0 ? ",threads=" + std::to_string(threads) : std::string());
  impl_->device = rtcNewDevice(config.c_str());
  if (!impl_->device) fail(nullptr);
  rtcSetDeviceMemoryMonitorFunction(impl_->device, count_bytes, &impl_->bytes);
  for (const ObjectRange& range : scene.objects) {
    TracedObject& o = impl_->instances.objects.emplace_back(impl_->begin());
    impl_->add_meshes(scene, range.first_mesh, range.mesh_count, &o);
    impl_->add_spheres(scene, range.first_sphere, range.sphere_count, &o);
    rtcCommitScene(o.scene);
  }
  TracedObject& world = impl_->world = impl_->begin();
  impl_->add_meshes(scene, 0, scene.world_mesh_count(), &world);
  impl_->add_spheres(scene, 0, scene.world_sphere_count(), &world);
  if (scene.any_instances()) {
    impl_->instances.scene = &scene;
    // Hits in them name primitives of the whole scene.
    const size_t geometries = attach_instances(impl_->device, world.scene, &impl_->instances);
    world.first_primitive.insert(world.first_primitive.end(), geometries, 0);
  }
  rtcCommitScene(world.scene);
  if (rtcGetDeviceError(impl_->device) != RTC_ERROR_NONE) fail(impl_->device);
}

Accel::~Accel() = default;

uint64_t Accel::bytes() const { return static_cast<uint64_t>(std::max<int64_t>(impl_->bytes, 0)); }

// Eight rays at a time, traversed as incoherent ones. Against that, of the time of pt on coffee: coherent
// traversal takes 1.7 times as much, single rays for closest hits 1.1, single rays for occlusion 1.1 to 1.2;
// a tree of high quality gains nothing (all +- 0.1).
void Accel::closest_hits(TracedRay* rays, const int32_t* ids, int count, const float* times,
                         KindsOfRays kinds, const PassedSurfaces* passed) const {
  if (impl_->few) return impl_->few->closest_hits(rays, ids, count);
  const std::vector<int32_t>& first = impl_->world.first_primitive;
  TraceContext context(-1, nullptr, passed);
  for (int begin = 0; begin < count; begin += kPacket) {
    const int n = std::min(kPacket, count - begin);
    const Int8 lanes = lane_index<Float8>();
    Float8 r[8];
    load_records(as_records(rays), gather(ids + begin, lanes < n ? lanes : n - 1), r);
    RTCRayHit8 packet;
    alignas(32) int valid[kPacket];
    store(valid, lanes < n);
    store(packet.ray.org_x, r[0]);
    store(packet.ray.org_y, r[1]);
    store(packet.ray.org_z, r[2]);
    store(packet.ray.dir_x, r[3]);
    store(packet.ray.dir_y, r[4]);
    store(packet.ray.dir_z, r[5]);
    // Above 0: a camera may stand exactly on a surface, which it must not hit.
    store(packet.ray.tnear, splat<Float8>(std::numeric_limits<float>::min()));
    store(packet.ray.tfar, splat<Float8>(std::numeric_limits<float>::infinity()));
    for (int l = 0; l < kPacket; ++l) {
      const int32_t id = ids[begin + std::min(l, n - 1)];
      packet.ray.time[l] = times ? times[id] : 0;
      packet.ray.mask[l] = kinds[id];
      packet.ray.id[l] = static_cast<unsigned>(id);
      packet.ray.flags[l] = 0;
      packet.hit.geomID[l] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][l] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect8(valid, impl_->world.scene, &context.base, &packet);
    for (int l = 0; l < n; ++l) {
      TracedRay& ray = rays[ids[begin + l]];
      const unsigned g = packet.hit.geomID[l];
      ray.prim = g == RTC_INVALID_GEOMETRY_ID ? -1 : first[g] + static_cast<int32_t>(packet.hit.primID[l]);
      // RTC_INVALID_GEOMETRY_ID is -1.
      ray.instance = static_cast<int32_t>(packet.hit.instID[0][l]);
    }
  }
}

void Accel::occluded(const RayView& rays, const float* tfar, int count, uint8_t* occluded, uint8_t* crossed,
                     RayKinds kinds) const {
  if (impl_->few) return impl_->few->occluded(rays, tfar, count, occluded, crossed);
  unsigned met = 0;
  TraceContext context(-1, crossed ? &met : nullptr);
  for (int begin = 0; begin < count; begin += kPacket) {
    const int n = std::min(kPacket, count - begin);
    RTCRay8 packet;
    alignas(32) int valid[kPacket];
    for (int l = 0; l < kPacket; ++l) {
      const int i = begin + std::min(l, n - 1);
      valid[l] = l < n ? -1 : 0;
      packet.org_x[l] = rays.ox[i];
      packet.org_y[l] = rays.oy[i];
      packet.org_z[l] = rays.oz[i];
      packet.dir_x[l] = rays.dx[i];
      packet.dir_y[l] = rays.dy[i];
      packet.dir_z[l] = rays.dz[i];
      packet.tnear[l] = 0;
      packet.tfar[l] = tfar[i];
      packet.time[l] = rays.time ? rays.time[i] : 0;
      packet.mask[l] = kinds;
      packet.id[l] = static_cast<unsigned>(l);
      packet.flags[l] = 0;
    }
    met = 0;
    rtcOccluded8(valid, impl_->world.scene, &context.base, &packet);
    for (int l = 0; l < n; ++l) occluded[begin + l] = packet.tfar[l] < 0;
    for (int l = 0; crossed && l < n; ++l) crossed[begin + l] = met >> l & 1;
  }
}

}  // namespace lightmill
