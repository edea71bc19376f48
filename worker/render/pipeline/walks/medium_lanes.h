#pragma once
// What walks of paths and of shadow rays through media share.
#include <bit>

#include "worker/render/math/exp.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/pipeline/work_items.h"
#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

inline Vec3<Lane> gather_rgb(const float (*rows)[kWavefront], LaneInt i) {
  return {gather(rows[0], i), gather(rows[1], i), gather(rows[2], i)};
}
template <size_t n>
void scatter_rgb(float (*rows)[n], LaneInt i, const Vec3<Lane>& v, LaneMask mask) {
  scatter(rows[0], i, v.x, mask);
  scatter(rows[1], i, v.y, mask);
  scatter(rows[2], i, v.z, mask);
}

inline Vec3<Lane> exp_minus(const Vec3<Lane>& x) {
  return {exp_negative(-x.x), exp_negative(-x.y), exp_negative(-x.z)};
}
inline Lane mean(const Vec3<Lane>& v) { return (v.x + v.y + v.z) * (1.0f / 3); }

/// The probability of each channel to be the one by which a segment is drawn.
inline Vec3<Lane> channel_shares(const Vec3<Lane>& throughput) {
  const Lane sum = throughput.x + throughput.y + throughput.z;
  return throughput * (1.0f / select(LaneMask(sum > 0.0f), sum, splat<Lane>(1.0f)));
}

/// Where rays enter and leave the sphere at which media without boundary end, at or after their origin.
struct Outermost {
  Lane enter, leave;
  Outermost(const RenderScene& scene, const Vec3<Lane>& o, const Vec3<Lane>& d) {
    const Vec3<Lane> to_center{scene.bounds_center[0] - o.x, scene.bounds_center[1] - o.y,
                               scene.bounds_center[2] - o.z};
    const Lane along = dot(to_center, d);
    // By the distance of the line: a difference of squares would cancel.
    const Vec3<Lane> across = to_center - d * along;
    const Lane half = safe_sqrt(scene.media_reach * scene.media_reach - dot(across, across));
    enter = max(along - half, Lane{});
    leave = max(along + half, Lane{});
  }
};

/// The surfaces that rays hit, for the lanes in `hit`.
inline Surface<Lane> surfaces(const RenderScene& scene, LaneInt prim, LaneInt instance, LaneMask hit,
                              const Vec3<Lane>& o, const Vec3<Lane>& d, Lane time) {
  // The other lanes take a primitive that exists.
  const int first = std::countr_zero(mask_bits(hit));
  return surface_at<Lane>(scene, select(hit, prim, splat_int<Lane>(lane(prim, first))),
                          select(hit, instance, splat_int<Lane>(lane(instance, first))), o, d, time);
}

}  // namespace lightmill
