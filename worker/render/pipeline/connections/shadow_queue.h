#pragma once
// The queue of contributions that wait for visibility. They are evaluated first, so that a zero is never
// traced.
#include <bit>

#include "worker/render/math/compress.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/kernel_choice.h"
#include "worker/render/pipeline/paths/first_event.h"
#include "worker/render/pipeline/paths/roulette.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/pipeline/shadow_caster.h"
#include "worker/render/pipeline/walks/medium_walk.h"
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// Segments end this fraction short of their target, which they must not hit: the hit distance has a rounding
/// error of a few ulps of the segment's length.
inline constexpr float kSegmentEnd = 1 - 0x1p-18f;

/// Contributions that wait for visibility, in lanes.
struct Candidates {
  Vec3<Lane> origin, direction;  // segment from origin to origin + direction, or a ray if infinite
  Lane tfar;
  Vec3<Lane> value;
  LaneInt target;
  LaneInt path;                                 // slot of the path that gives the time
  LaneInt group{};                              // light group (groups_of)
  LobeLanes lobes{};                            // first_event.h
  Lane raster_x{}, raster_y{}, small_choice{};  // of splats
  // With media: the one that the segment starts in, and w_light + w_camera without P~ of the segment.
  LaneInt medium{};
  Lane ratio{};
  LaneInt light{};      // of next event: MediaWork::shadow_light
  LaneInt volume{};     // MediaWork::shadow_volume
  UintOf<Lane> seed{};  // of the walk through grids
};

/// Drops zero contributions and counts them, plays roulette with `u` for those below `tiny_contribution`, and
/// queues the rest.
template <class K>
void queue(const StageContext& context, const Candidates& c, LaneMask active, float tiny_contribution, Lane u,
           bool splats, Wavefront& w) {
  const Lane size = max_component(c.value);
  // NaN and negative values in any channel go on to the film, which counts them: only exact zeros are dropped
  // here. (The largest channel would not do: beside NaN it may be 0.)
  const Lane sum = abs(c.value.x) + abs(c.value.y) + abs(c.value.z);
  const LaneMask nonzero = mask_and(active, mask_not(LaneMask(sum == 0.0f)));
  const unsigned active_bits = mask_bits(active), nonzero_bits = mask_bits(nonzero);
  w.counters.zero_connections_skipped += static_cast<uint64_t>(std::popcount(active_bits & ~nonzero_bits));
  if (!nonzero_bits) {
    if (StrategyRecorder* recorder = recorder_of<K>(w)) recorder->candidates(active_bits, active_bits, 0);
    return;
  }
  unsigned bits = nonzero_bits;
  Lane scale = splat<Lane>(1.0f);
  if (tiny_contribution > 0) {
    const LaneMask tiny = LaneMask(size < tiny_contribution);
    const Lane q = max(size * (1.0f / tiny_contribution), splat<Lane>(kLeastSurvival));
    const LaneMask lost = mask_and(tiny, LaneMask(u >= q));
    scale = select(tiny, 1.0f / q, scale);
    bits &= ~mask_bits(lost);
    w.counters.rouletted_connections += static_cast<uint64_t>(std::popcount(nonzero_bits & ~bits));
  }
  if (StrategyRecorder* recorder = recorder_of<K>(w))
    recorder->candidates(active_bits, active_bits & ~nonzero_bits, nonzero_bits & ~bits);
  if (w.shadow.count + kLanes > ShadowRays::kCapacity) flush_shadow_rays(context, splats, w);
  ShadowRays& q = w.shadow;
  const Vec3<Lane> value = c.value * scale;
  // There is room for all lanes.
  const auto add = [&](auto* to, const auto& x) { store_compressed(to + q.count, x, bits); };
  add(q.ox, c.origin.x), add(q.oy, c.origin.y), add(q.oz, c.origin.z);
  add(q.dx, c.direction.x), add(q.dy, c.direction.y), add(q.dz, c.direction.z);
  add(q.tfar, c.tfar);
  add(q.r, value.x), add(q.g, value.y), add(q.b, value.z);
  add(q.target, c.target);
  if (w.groups) add(q.group, c.group);
  if (LobedLight* lobes = lobes_of<K>(w)) {
    add(lobes->shadow_part, c.lobes.part);
    add(lobes->shadow_diffuse[0], c.lobes.diffuse.x);
    add(lobes->shadow_diffuse[1], c.lobes.diffuse.y);
    add(lobes->shadow_diffuse[2], c.lobes.diffuse.z);
  }
  if (splats) add(q.raster_x, c.raster_x), add(q.raster_y, c.raster_y), add(q.small_choice, c.small_choice);
  if (context.scene.any_moving()) add(q.time, gather(w.paths.time, c.path));
  if constexpr (K::kMedia)
    add(w.media->shadow_medium, c.medium), add(w.media->shadow_ratio, c.ratio),
        add(w.media->shadow_light, c.light), add(w.media->shadow_volume, c.volume),
        add(w.media->shadow_seed, as_int(c.seed));
  if (StrategyRecorder* recorder = recorder_of<K>(w)) {
    int i = q.count;
    for (unsigned left = bits; left; left &= left - 1) {
      const int l = std::countr_zero(left);
      recorder->queued(l, i++, tiny_contribution > 0 ? lane(size, l) / tiny_contribution : kNoRoulette);
    }
  }
  q.count += std::popcount(bits);
}

}  // namespace lightmill
