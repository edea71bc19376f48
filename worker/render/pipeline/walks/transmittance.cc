// Shadow rays through media: trace_transmittance of medium_walk.h.
#include <bit>

#include "worker/render/pipeline/lane_group.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/walks/medium_lanes.h"
#include "worker/render/pipeline/walks/medium_walk.h"
#include "worker/render/pipeline/walks/moving_grids.h"
#include "worker/render/pipeline/walks/volume_walk.h"
#include "worker/render/scene/materials/pane.h"

namespace lightmill {
namespace {

Vec3<Lane> gather_rows(const float (*from)[ShadowRays::kCapacity], LaneInt slot) {
  return {gather(from[0], slot), gather(from[1], slot), gather(from[2], slot)};
}

/// A part of a shadow ray per lane, as far as the next boundary or its end.
struct ShadowSegment {
  Vec3<Lane> o, d;
  LaneInt prim, instance, medium;
  LaneMask finite, crosses, free;  // whether it has an end; is at a boundary; is not blocked
  Lane length{};                   // of the part
  Lane length_d{};                 // of d
  Surface<Lane> s{};
  LaneInt sides{};
  LaneMask varies;  // the medium is a grid
};

/// One step of shadow rays.
class ShadowStep {
 public:
  ShadowStep(const StageContext& context, bool visible_to_end, ShadowRays& q, MediaWork& m)
      : scene_(context.scene), visible_to_end_(visible_to_end), q_(q), m_(m) {}

  /// Takes rays `slots` on to the next boundary or their end. Those at a boundary are added to `crossing`.
  void run(const std::vector<int32_t>& slots, std::vector<int32_t>* crossing) {
    for (size_t chunk = 0; chunk < slots.size(); chunk += kWaysAtOnce) {
      const size_t end = std::min(chunk + kWaysAtOnce, slots.size());
      m_.ways.clear();
      for (size_t base = chunk; base < end && !scene_.volumes.empty(); base += kLanes) {
        const Group e(slots, base);
        add_ways(e, begin(e));
      }
      if (!m_.ways.empty()) pass_through_volumes(scene_, &m_.ways);
      size_t next = 0;
      for (size_t base = chunk; base < end; base += kLanes) {
        const Group e(slots, base);
        const ShadowSegment g = begin(e);
        if (any(g.varies)) take(e, g.varies, take_ways(m_.ways, &next, g.varies));
        append(crossing, e.slot, finish(e, g));
      }
    }
  }

 private:
  ShadowSegment begin(const Group& e) const {
    ShadowSegment g;
    Lane r[8];
    load_records(as_records(m_.shadow_rays), e.slot, r);
    g.o = {r[0], r[1], r[2]}, g.d = {r[3], r[4], r[5]};
    g.prim = as_int(float_bits(r[6])), g.instance = as_int(float_bits(r[7]));
    const Lane tfar = gather(q_.tfar, e.slot);
    g.finite = LaneMask(tfar <= 1.0f);
    g.medium = gather(m_.shadow_medium, e.slot);
    g.length_d = sqrt(dot(g.d, g.d));
    g.crosses = splat_mask<Lane>(false), g.free = e.active;
    Lane far{};
    if (!visible_to_end_) {
      LaneMask hit = mask_and(e.active, LaneMask(g.prim >= 0));
      if (any(hit)) {
        const Lane time = scene_.any_moving() ? gather(q_.time, e.slot) : Lane{};
        g.s = surfaces(scene_, g.prim, g.instance, hit, g.o, g.d, time);
        g.sides = gather(scene_.primitive_media.data(), select(hit, g.prim, LaneInt{}));
        const Vec3<Lane> segment = g.s.p - g.o;
        far = sqrt(dot(segment, segment));
        hit = mask_and(hit, LaneMask(far < tfar * g.length_d));
        g.crosses = mask_and(hit, LaneMask(g.sides < 0));
        g.free = mask_and(g.free, mask_not(mask_and(hit, mask_not(g.crosses))));
      }
    }
    const Lane end = select(g.finite, g.length_d, Outermost(scene_, g.o, g.d).leave);
    g.length = select(g.crosses, far, end);
    const LaneMask filled = mask_and(g.free, LaneMask(g.medium != 0));
    const MediumRecord<Lane> record(scene_.media.data(), g.medium);
    g.varies =
        scene_.volumes.empty() ? splat_mask<Lane>(false) : mask_and(filled, LaneMask(record.grid() != 0));
    return g;
  }

  void add_ways(const Group& e, const ShadowSegment& g) {
    if (!any(g.varies)) return;
    VolumeWay<Lane> way{.medium = g.medium,
                        .origin = g.o,
                        .direction = g.d,
                        .until = g.length / g.length_d,
                        .length = g.length_d,
                        .seed = gather(m_.shadow_seed, e.slot),
                        .drawn = gather(m_.shadow_drawn, e.slot),
                        .left = gather(m_.shadow_left, e.slot),
                        .optical = gather_rows(m_.shadow_depth, e.slot),
                        .rate = gather_rows(m_.shadow_rate, e.slot),
                        .nulls = gather_rows(m_.shadow_nulls, e.slot)};
    const Lane time = scene_.any_moving() ? gather(q_.time, e.slot) : Lane{};
    take_to_rest(scene_, g.varies, time, &way);
    append_ways(way, g.varies, &m_.ways);
  }
  void take(const Group& e, LaneMask mask, const VolumeWay<Lane>& found) {
    scatter(m_.shadow_drawn, e.slot, found.drawn, mask);
    scatter(m_.shadow_left, e.slot, found.left, mask);
    scatter_rgb(m_.shadow_depth, e.slot, found.optical, mask);
    scatter_rgb(m_.shadow_rate, e.slot, found.rate, mask);
    scatter_rgb(m_.shadow_nulls, e.slot, found.nulls, mask);
  }

  LaneMask finish(const Group& e, const ShadowSegment& g) {
    for (unsigned bits = mask_bits(mask_and(e.active, mask_not(g.free))); bits; bits &= bits - 1)
      q_.occluded[lane(e.slot, std::countr_zero(bits))] = 1;
    const MediumRecord<Lane> record(scene_.media.data(), g.medium);
    const LaneMask even = mask_and(mask_and(g.free, LaneMask(g.medium != 0)), mask_not(g.varies));
    const Lane length = select(even, g.length, Lane{});
    const auto add = [&](float(*rows)[ShadowRays::kCapacity], int slot) {
      for (int c = 0; c < 3; ++c)
        scatter(rows[c], e.slot, gather(rows[c], e.slot) + record.scalar(slot + c) * length, even);
    };
    add(m_.shadow_depth, kMediumExtinction);
    add(m_.shadow_rate, kMediumCollision);
    return any(g.crosses) ? cross(e, g) : g.crosses;
  }

  /// Stores the rest of those that pass a boundary, and returns which have one.
  LaneMask cross(const Group& e, const ShadowSegment& g) {
    const Surface<Lane>& s = g.s;
    if (scene_.any_panes) {
      const Lane cosine = min(abs(dot(s.ng, g.d)) / g.length_d, splat<Lane>(1.0f));
      Vec3<Lane> depth = gather_rows(m_.shadow_depth, e.slot);
      const Lane passed = pane_transmittance<Lane>(scene_, g.prim, g.crosses, cosine, s, &depth);
      scatter(m_.shadow_panes, e.slot, gather(m_.shadow_panes, e.slot) * passed, g.crosses);
      scatter_rgb(m_.shadow_depth, e.slot, depth, g.crosses);
    }
    const LaneMask out = LaneMask(dot(s.ng, g.d) > 0.0f);
    scatter(m_.shadow_medium, e.slot, medium_on_side<Lane>(sides_met<Lane>(g.sides, g.medium), out),
            g.crosses);
    const Vec3<Lane> from = offset_origin(s.p, s.error, s.ng, g.d);
    const Vec3<Lane> target{gather(q_.ox, e.slot) + gather(q_.dx, e.slot),
                            gather(q_.oy, e.slot) + gather(q_.dy, e.slot),
                            gather(q_.oz, e.slot) + gather(q_.dz, e.slot)};
    const Vec3<Lane> rest = select(g.finite, target - from, g.d);
    const Lane next[8] = {from.x,
                          from.y,
                          from.z,
                          rest.x,
                          rest.y,
                          rest.z,
                          bits_float(as_uint(g.prim)),
                          bits_float(as_uint(g.instance))};
    store_records(as_records(m_.shadow_rays), e.slot, mask_bits(g.crosses), next);
    // The boundary may be as near to the end as the offset is long.
    return mask_and(g.crosses, LaneMask(dot(rest, g.d) > 0.0f));
  }

  const RenderScene& scene_;
  bool visible_to_end_;
  ShadowRays& q_;
  MediaWork& m_;
};

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

void trace_transmittance(const StageContext& context, RayKinds kinds, Wavefront& w) {
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
  context.accel.occluded(view, q.tfar, q.count, q.occluded, boundaries ? m.shadow_crossed : nullptr, kinds);
  m.casting.clear();
  m.walking.clear();
  for (int32_t i = 0; i < q.count; ++i) {
    if (q.occluded[i]) continue;
    (boundaries && m.shadow_crossed[i] ? m.casting : m.walking).push_back(i);
  }
  const auto walk = [&](bool visible_to_end) {
    ShadowStep(context, visible_to_end, q, m).run(m.walking, &m.casting);
  };
  walk(true);  // without boundaries on its way a segment has one medium
  while (!m.casting.empty()) {
    context.accel.closest_hits(m.shadow_rays, m.casting.data(), static_cast<int>(m.casting.size()), view.time,
                               {nullptr, kinds});
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
