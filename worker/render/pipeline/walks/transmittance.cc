// Shadow rays through media: trace_transmittance of medium_walk.h.
#include <bit>

#include "worker/render/pipeline/lane_group.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/walks/medium_lanes.h"
#include "worker/render/pipeline/walks/medium_walk.h"
#include "worker/render/pipeline/walks/volume_walk.h"
#include "worker/render/scene/materials/pane.h"

namespace lightmill {
namespace {

/// Continues shadow rays through grids up to `until`.
void shadow_grids(const RenderScene& scene, LaneInt slot, LaneMask mask, LaneInt medium, const Vec3<Lane>& o,
                  const Vec3<Lane>& d, Lane until, MediaWork& m) {
  const auto rows = [&](const float(*from)[ShadowRays::kCapacity]) {
    return Vec3<Lane>{gather(from[0], slot), gather(from[1], slot), gather(from[2], slot)};
  };
  VolumeWalk walk{.active = mask,
                  .medium = medium,
                  .origin = o,
                  .direction = d,
                  .from = Lane{},
                  .until = until,
                  .seed = as_uint(gather(m.shadow_seed, slot)),
                  .drawn = gather(m.shadow_drawn, slot),
                  .left = gather(m.shadow_left, slot),
                  .optical = rows(m.shadow_depth),
                  .rate = rows(m.shadow_rate),
                  .nulls = rows(m.shadow_nulls)};
  pass_through_volumes(scene, &walk);
  scatter(m.shadow_drawn, slot, walk.drawn, mask);
  scatter(m.shadow_left, slot, walk.left, mask);
  scatter_rgb(m.shadow_depth, slot, walk.optical, mask);
  scatter_rgb(m.shadow_rate, slot, walk.rate, mask);
  scatter_rgb(m.shadow_nulls, slot, walk.nulls, mask);
}

/// One step of shadow rays: as far as the next boundary or their end. Returns the lanes at a boundary.
LaneMask shadow_step(const StageContext& context, const Group& e, ShadowRays& q, MediaWork& m,
                     bool visible_to_end) {
  const RenderScene& scene = context.scene;
  Lane r[8];
  load_records(as_records(m.shadow_rays), e.slot, r);
  const Vec3<Lane> o{r[0], r[1], r[2]}, d{r[3], r[4], r[5]};
  const LaneInt prim = as_int(float_bits(r[6])), instance = as_int(float_bits(r[7]));
  const Lane tfar = gather(q.tfar, e.slot);
  const LaneMask finite = LaneMask(tfar <= 1.0f);
  const LaneInt medium = gather(m.shadow_medium, e.slot);
  const Lane length_d = sqrt(dot(d, d));
  LaneMask crosses = splat_mask<Lane>(false), free = e.active;
  Surface<Lane> s{};
  LaneInt sides{};
  Lane far{};
  if (!visible_to_end) {
    LaneMask hit = mask_and(e.active, LaneMask(prim >= 0));
    if (any(hit)) {
      const Lane time = scene.any_moving() ? gather(q.time, e.slot) : Lane{};
      s = surfaces(scene, prim, instance, hit, o, d, time);
      sides = gather(scene.primitive_media.data(), select(hit, prim, LaneInt{}));
      const Vec3<Lane> segment = s.p - o;
      far = sqrt(dot(segment, segment));
      hit = mask_and(hit, LaneMask(far < tfar * length_d));
      crosses = mask_and(hit, LaneMask(sides < 0));
      const LaneMask blocked = mask_and(hit, mask_not(crosses));
      free = mask_and(free, mask_not(blocked));
      for (unsigned bits = mask_bits(blocked); bits; bits &= bits - 1)
        q.occluded[lane(e.slot, std::countr_zero(bits))] = 1;
    }
  }
  const MediumRecord<Lane> record(scene.media.data(), medium);
  LaneMask filled = mask_and(free, LaneMask(medium != 0));
  const Lane end = select(finite, length_d, Outermost(scene, o, d).leave);
  const Lane all = select(crosses, far, end);
  if (!scene.volumes.empty()) {
    const LaneMask varies = mask_and(filled, LaneMask(record.grid() != 0));
    filled = mask_and(filled, mask_not(varies));
    if (any(varies)) shadow_grids(scene, e.slot, varies, medium, o, d, all / length_d, m);
  }
  const Lane length = select(filled, all, Lane{});
  const auto add = [&](float(*rows)[ShadowRays::kCapacity], int slot) {
    for (int c = 0; c < 3; ++c)
      scatter(rows[c], e.slot, gather(rows[c], e.slot) + record.scalar(slot + c) * length, filled);
  };
  add(m.shadow_depth, kMediumExtinction);
  add(m.shadow_rate, kMediumCollision);
  if (!any(crosses)) return crosses;

  if (scene.any_panes) {
    const Lane cosine = min(abs(dot(s.ng, d)) / length_d, splat<Lane>(1.0f));
    scatter(m.shadow_panes, e.slot,
            gather(m.shadow_panes, e.slot) * pane_transmittance<Lane>(scene, prim, crosses, cosine), crosses);
  }
  const LaneMask out = LaneMask(dot(s.ng, d) > 0.0f);
  scatter(m.shadow_medium, e.slot, medium_on_side<Lane>(sides_met<Lane>(sides, medium), out), crosses);
  const Vec3<Lane> from = offset_origin(s.p, s.error, s.ng, d);
  const Vec3<Lane> target{gather(q.ox, e.slot) + gather(q.dx, e.slot),
                          gather(q.oy, e.slot) + gather(q.dy, e.slot),
                          gather(q.oz, e.slot) + gather(q.dz, e.slot)};
  const Vec3<Lane> rest = select(finite, target - from, d);
  const Lane next[8] = {from.x, from.y, from.z, rest.x, rest.y, rest.z, r[6], r[7]};
  store_records(as_records(m.shadow_rays), e.slot, mask_bits(crosses), next);
  // The boundary may be as near to the end as the offset is long.
  return mask_and(crosses, LaneMask(dot(rest, d) > 0.0f));
}

/// The first number of each shadow ray says how far its first tentative collision is.
void begin_grids(size_t count, MediaWork& m) {
  const size_t padded = (count + kLanes - 1) / kLanes * kLanes;
  for (auto& channel : m.shadow_nulls) std::fill_n(channel, padded, 1.0f);
  std::fill(m.shadow_seed + count, m.shadow_seed + padded, 0);
  std::fill_n(m.shadow_drawn, padded, 1);
  for (size_t base = 0; base < count; base += kLanes) {
    store(m.shadow_left + base, walk_depth(as_uint(load_int<Lane>(m.shadow_seed + base)), LaneInt{}));
  }
}

}  // namespace

void trace_transmittance(const StageContext& context, Wavefront& w) {
  ShadowRays& q = w.shadow;
  MediaWork& m = *w.media;
  const auto count = static_cast<size_t>(q.count);
  for (size_t i = 0; i < count; ++i) {
    m.shadow_rays[i] = {{q.ox[i], q.oy[i], q.oz[i]}, {q.dx[i], q.dy[i], q.dz[i]}, -1, -1};
  }
  for (int c = 0; c < 3; ++c) {
    std::fill_n(m.shadow_depth[c], count, 0.0f);
    std::fill_n(m.shadow_rate[c], count, 0.0f);
  }
  std::fill_n(m.shadow_panes, (count + kLanes - 1) / kLanes * kLanes, 1.0f);
  const bool boundaries = context.scene.any_boundaries;
  const bool grids = !context.scene.volumes.empty();
  if (grids) begin_grids(count, m);
  const RayView view = view_of(context.scene, q);
  context.accel.occluded(view, q.tfar, q.count, q.occluded, boundaries ? m.shadow_crossed : nullptr);
  m.casting.clear();
  m.walking.clear();
  for (int32_t i = 0; i < q.count; ++i) {
    if (q.occluded[i]) continue;
    (boundaries && m.shadow_crossed[i] ? m.casting : m.walking).push_back(i);
  }
  const auto walk = [&](bool visible_to_end) {
    for (size_t base = 0; base < m.walking.size(); base += kLanes) {
      const Group e(m.walking, base);
      append(&m.casting, e.slot, shadow_step(context, e, q, m, visible_to_end));
    }
  };
  walk(true);  // without boundaries on its way a segment has one medium
  while (!m.casting.empty()) {
    context.accel.closest_hits(m.shadow_rays, m.casting.data(), static_cast<int>(m.casting.size()),
                               view.time);
    w.counters.shadow_rays += m.casting.size();
    m.walking.swap(m.casting);
    m.casting.clear();
    walk(false);
  }
  if (m.arrivals) {
    for (size_t i = 0; i < count; ++i) {
      if (!q.occluded[i])
        m.arrivals->push_back({m.shadow_light[i] >> 1, (m.shadow_light[i] & 1) != 0, m.shadow_medium[i]});
    }
  }
  for (size_t base = 0; base < count; base += kLanes) {  // arrays of a multiple of kLanes
    const auto rows = [&](float(*from)[ShadowRays::kCapacity]) {
      return exp_minus({load<Lane>(from[0] + base), load<Lane>(from[1] + base), load<Lane>(from[2] + base)});
    };
    const Lane panes = load<Lane>(m.shadow_panes + base);
    Vec3<Lane> transmitted = rows(m.shadow_depth), reached = rows(m.shadow_rate);
    if (grids) {
      const Vec3<Lane> nulls{load<Lane>(m.shadow_nulls[0] + base), load<Lane>(m.shadow_nulls[1] + base),
                             load<Lane>(m.shadow_nulls[2] + base)};
      transmitted = transmitted * nulls, reached = reached * nulls;
    }
    const LaneInt volume = load_int<Lane>(m.shadow_volume + base);
    const LaneMask shines =
        mask_or(LaneMask(volume == 0), LaneMask(volume == load_int<Lane>(m.shadow_medium + base)));
    transmitted = select(shines, transmitted * panes, Vec3<Lane>{});
    const Lane passed = mean(reached) * panes, ratio = load<Lane>(m.shadow_ratio + base);
    const Lane reweighted = (1.0f + ratio) / (1.0f + ratio * passed);
    store(m.passed + base, passed);
    store(q.r + base, load<Lane>(q.r + base) * transmitted.x * reweighted);
    store(q.g + base, load<Lane>(q.g + base) * transmitted.y * reweighted);
    store(q.b + base, load<Lane>(q.b + base) * transmitted.z * reweighted);
  }
}

}  // namespace lightmill
