#pragma once
// Adds contributions to the radiance of camera paths.
#include <bit>
#include <cmath>
#include <limits>

#include "worker/render/light/light_table.h"
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// Most contributions are told to be finite by the first test. The second is for those whose channels add up
/// to infinity.
inline bool is_finite(float r, float g, float b) {
  return std::fabs(r + g + b) <= std::numeric_limits<float>::max() ||
         (std::isfinite(r) && std::isfinite(g) && std::isfinite(b));
}

/// Counts something of the camera path in `slot` that is not finite.
inline void drop_not_finite(Wavefront& w, size_t slot) {
  ++w.counters.nonfinite;
  w.dropped.add(DropKind::kNotFinite, w.slots.weight[slot]);
}
/// Counts something of a light path that is not finite.
inline void drop_not_finite_light(Wavefront& w) {
  ++w.counters.nonfinite;
  w.dropped_light.add(DropKind::kNotFinite, 1);
}

/// Adds a contribution of a light group and lobe. One that is not finite is left out and counted: the path's
/// other light is kept.
inline void add_to_path(Wavefront& w, size_t slot, float r, float g, float b, int32_t group,
                        const LobeOf& lobe) {
  if (!is_finite(r, g, b)) return drop_not_finite(w, slot);
  if (w.groups) w.groups->add(group, slot, r, g, b);
  if (w.lobes) w.lobes->add(lobe, slot, r, g, b);
  w.radiance_r[slot] += r;
  w.radiance_g[slot] += g;
  w.radiance_b[slot] += b;
}

inline LobeOf lane_of(const LobeLanes& lobes, int l) {
  return {lane(lobes.part, l),
          {lane(lobes.diffuse.x, l), lane(lobes.diffuse.y, l), lane(lobes.diffuse.z, l)}};
}

/// The light groups of lights; 0 where nobody asks. Every index must be valid.
inline LaneInt groups_of(const Wavefront& w, const LightTable& lights, LaneInt light) {
  return w.groups ? gather(lights.group_of.data(), light) : LaneInt{};
}

/// The same for the lanes in `m`, in lane order. `group`: see groups_of; `lobes`: see first_event.h.
inline void add_radiance(Wavefront& w, LaneInt slot, LaneMask m, const Vec3<Lane>& c, LaneInt group,
                         const LobeLanes& lobes) {
  for (unsigned bits = mask_bits(m); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const LobeOf lobe = w.lobes ? lane_of(lobes, l) : LobeOf{};
    add_to_path(w, static_cast<size_t>(lane(slot, l)), lane(c.x, l), lane(c.y, l), lane(c.z, l),
                lane(group, l), lobe);
  }
}

}  // namespace lightmill
