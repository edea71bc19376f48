#include "tests/bench/render/bare_embree.h"

#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <xmmintrin.h>

#include <algorithm>
#include <limits>

#include "common/base/error.h"
#include "worker/render/pipeline/recording/thread_time.h"
#include "worker/render/scene/geometry/alpha_mask.h"

namespace lightmill::bench {
namespace {

constexpr size_t kPacket = 8;

void set_ray(const StageProbe::Segment& s, float near, float far, size_t l, RTCRay8* ray) {
  ray->org_x[l] = s.ox, ray->org_y[l] = s.oy, ray->org_z[l] = s.oz;
  ray->dir_x[l] = s.dx, ray->dir_y[l] = s.dy, ray->dir_z[l] = s.dz;
  ray->tnear[l] = near, ray->tfar[l] = far;
  ray->time[l] = 0, ray->mask[l] = ~0u, ray->id[l] = 0, ray->flags[l] = 0;
}

}  // namespace

struct BareEmbree::Impl {
  RTCDevice device = rtcNewDevice("isa=avx2,frequency_level=simd256");
  RTCScene scene = rtcNewScene(device);
  std::vector<RTCRayHit8> closest;
  std::vector<RTCRay8> occlusion;
  ~Impl() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
};

BareEmbree::BareEmbree(const RenderScene& scene) : impl_(std::make_unique<Impl>()) {
  if (scene.sphere_count() > 0 || scene.any_instances() || scene.any_alpha)
    throw Error(ErrorKind::kBadScene, "the scene has more than plain triangles");
  rtcSetSceneFlags(impl_->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(impl_->scene, RTC_BUILD_QUALITY_MEDIUM);
  for (const MeshRange& mesh : scene.meshes) {
    RTCGeometry g = rtcNewGeometry(impl_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, scene.positions.data(), 0, 12,
                               (scene.positions.size() - 4) / 3);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, scene.indices.data(),
                               static_cast<size_t>(mesh.first_triangle) * 12, 12,
                               static_cast<size_t>(mesh.triangle_count));
    rtcCommitGeometry(g);
    rtcAttachGeometry(impl_->scene, g);
    rtcReleaseGeometry(g);
  }
  rtcCommitScene(impl_->scene);
  if (rtcGetDeviceError(impl_->device) != RTC_ERROR_NONE)
    throw Error(ErrorKind::kFailed, "Embree can't build the scene");
}

BareEmbree::~BareEmbree() = default;

void BareEmbree::take(const std::vector<StageProbe::Segment>& closest,
                      const std::vector<StageProbe::Segment>& occlusion) {
  impl_->closest.assign(closest.size() / kPacket, {});
  for (size_t i = 0; i < impl_->closest.size(); ++i) {
    RTCRayHit8& packet = impl_->closest[i];
    for (size_t l = 0; l < kPacket; ++l) {
      set_ray(closest[i * kPacket + l], std::numeric_limits<float>::min(),
              std::numeric_limits<float>::infinity(), l, &packet.ray);
      packet.hit.geomID[l] = packet.hit.instID[0][l] = RTC_INVALID_GEOMETRY_ID;
    }
  }
  impl_->occlusion.assign(occlusion.size() / kPacket, {});
  for (size_t i = 0; i < impl_->occlusion.size(); ++i) {
    for (size_t l = 0; l < kPacket; ++l) {
      const StageProbe::Segment& s = occlusion[i * kPacket + l];
      set_ray(s, 0, s.tfar, l, &impl_->occlusion[i]);
    }
  }
}

namespace {

/// Denormals flushed, as in the renderer.
template <class Trace>
double traced(const Trace& trace) {
  const unsigned saved = _mm_getcsr();
  _mm_setcsr(saved | 0x8040);
  const double start = thread_cpu_seconds();
  trace();
  const double seconds = thread_cpu_seconds() - start;
  _mm_setcsr(saved);
  return seconds;
}

alignas(32) constexpr int kAll[kPacket] = {-1, -1, -1, -1, -1, -1, -1, -1};

}  // namespace

double BareEmbree::closest_seconds() {
  return traced([&] {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (const RTCRayHit8& rays : impl_->closest) {
      RTCRayHit8 packet = rays;  // tracing writes into it
      rtcIntersect8(kAll, impl_->scene, &context, &packet);
    }
  });
}

double BareEmbree::occlusion_seconds() {
  return traced([&] {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (const RTCRay8& rays : impl_->occlusion) {
      RTCRay8 packet = rays;
      rtcOccluded8(kAll, impl_->scene, &context, &packet);
    }
  });
}

}  // namespace lightmill::bench
