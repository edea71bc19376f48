#pragma once
// The boundaries of media on a straight line.
#include <cstdint>

#include "worker/render/accel/accel.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Calls met(near, far) with the media on both sides of each boundary on the way from `p` in direction `d`,
/// in order and through all that is met, until it returns false.
template <class Met>
void for_each_transition(const RenderScene& scene, const Accel& accel, Vec3<float> p, const Vec3<float>& d,
                         float time, Met&& met) {
  // Far more than scenes have on a line; one that two surfaces throw back and forth ends, too.
  constexpr int kMost = 1024;
  for (int i = 0; i < kMost; ++i) {
    TracedRay ray{{p.x, p.y, p.z}, {d.x, d.y, d.z}, -1, -1};
    const int32_t id = 0;
    accel.closest_hits(&ray, &id, 1, &time);
    if (ray.prim < 0) return;
    const Surface<float> s = surface_at<float>(scene, ray.prim, ray.instance, p, d, time);
    const int32_t sides = scene.primitive_media[static_cast<size_t>(ray.prim)];
    const bool out = dot(s.ng, d) > 0;
    if (sides & kMediumTransition) {
      const int32_t inside = sides & kMaxMedia, outside = sides >> kMediumBits & kMaxMedia;
      if (!met(out ? inside : outside, out ? outside : inside)) return;
    }
    p = offset_origin(s.p, s.error, s.ng, d);
  }
}

}  // namespace lightmill
