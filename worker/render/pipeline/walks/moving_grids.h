#pragma once
// Ways through grids that move.
#include <bit>
#include <cmath>

#include "worker/render/pipeline/walks/volume_way.h"
#include "worker/render/scene/media/grid_motion.h"
#include "worker/render/scene/media/medium.h"

namespace lightmill {

/// Takes ways whose grid moves to where it is as the shutter opens. `way` has origin, direction and start as
/// they are at `time`; a place on it keeps its parameter.
inline void take_to_rest(const RenderScene& scene, LaneMask mask, Lane time, VolumeWay<Lane>* way) {
  if (!scene.volumes.any_moving()) return;
  const LaneInt grid = MediumRecord<Lane>(scene.media.data(), select(mask, way->medium, LaneInt{})).grid();
  for (unsigned bits = mask_bits(mask); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const auto back = return_of_grid(scene.volumes, (lane(grid, l) - 1) * kGridFloats, lane(time, l));
    if (!back) continue;
    const auto of = [&](const Vec3<Lane>& v) {
      return Vec3<float>{lane(v.x, l), lane(v.y, l), lane(v.z, l)};
    };
    const auto set = [&](Vec3<Lane>* v, const Vec3<float>& x) { ToLane{l}(x, *v); };
    const Vec3<float> d = back->vector(of(way->direction));
    const float length = lane(way->length, l);
    set(&way->origin, back->point(of(way->origin)));
    set(&way->start, back->point(of(way->start)));
    set(&way->direction, d);
    set_lane(&way->stretch2, l, length * length / dot(d, d));
    set_lane(&way->density, l, static_cast<float>(1 / std::fabs(back->det)));
  }
}

}  // namespace lightmill
