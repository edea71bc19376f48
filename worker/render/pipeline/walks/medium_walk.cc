#include "worker/render/pipeline/walks/medium_walk.h"

#include <bit>

#include "worker/render/pipeline/lane_group.h"
#include "worker/render/pipeline/paths/path_io.h"
#include "worker/render/pipeline/paths/path_kinds.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/paths/path_vertex.h"
#include "worker/render/pipeline/recording/stage_probe.h"
#include "worker/render/pipeline/walks/medium_glow.h"
#include "worker/render/pipeline/walks/medium_lanes.h"
#include "worker/render/pipeline/walks/moving_grids.h"
#include "worker/render/pipeline/walks/volume_walk.h"
#include "worker/render/scene/materials/pane.h"

namespace lightmill {
namespace {

/// Draws the channel and the optical depth at which segments end.
void draw_depths(const SampleStream<Lane>& stream, uint32_t dim, const Vec3<Lane>& throughput,
                 LaneInt* channel, Lane* left) {
  const Lane pick = stream.get_random(dim) * (throughput.x + throughput.y + throughput.z);
  const Lane two = throughput.x + throughput.y;
  const LaneMask first = LaneMask(pick < throughput.x), second = LaneMask(pick < two);
  *channel = select(first, LaneInt{}, select(second, splat_int<Lane>(1), splat_int<Lane>(2)));
  const Lane low = select(first, Lane{}, select(second, throughput.x, two));
  const Lane width = select(first, throughput.x, select(second, throughput.y, throughput.z));
  // The rest of the number that made the choice extends the other's 24 bits: thin media end few segments, and
  // thick ones let few through.
  const Lane more = clamp((pick - low) / max(width, splat<Lane>(0x1p-120f)), 0.0f, 1 - 0x1p-24f) + 0x1p-25f;
  const Lane u = stream.get_1d(dim);
  *left = minus_log_one_minus(u + more * 0x1p-24f, (1.0f - u) - more * 0x1p-24f);
}

/// A segment per lane, as far as the next surface or boundary.
struct Segment {
  PathLanes<Lane> path;
  // Of MediaWork, so far.
  Lane left{}, pane_draw{}, panes = splat<Lane>(1.0f);
  LaneInt channel{}, drawn{};
  Vec3<Lane> optical{}, rate{}, nulls = splat3<Lane>(1, 1, 1);
  LaneMask hit;
  Surface<Lane> s{};
  LaneInt sides{};
  Lane near{}, far{};  // its part in the medium, by the distance from its origin
  LaneMask varies;     // the medium is a grid
};

/// One step of the walk of paths that are cast at `depth`.
template <bool kLight>
class Step {
 public:
  Step(const StageContext& context, const LayerContext& layer, int depth, bool first, Wavefront& w)
      : context_(context),
        scene_(context.scene),
        layer_(layer),
        depth_(depth),
        first_(first),
        grids_(!context.scene.volumes.empty()),
        shines_(!kLight && context.on(kEmissionHits)),
        w_(w),
        m_(*w.media) {}

  /// Walks `slots` to the next surface, boundary or collision. Those at a boundary, whose next ray is stored,
  /// are added to `crossing`.
  void run(const std::vector<int32_t>& slots, std::vector<int32_t>* crossing) {
    const auto finish_at = [&](const Group& e, const Segment& s, const VolumeWay<Lane>& found) {
      append(crossing, e.slot, finish(e, s, found));
    };
    if (!grids_) {
      for (size_t base = 0; base < slots.size(); base += kLanes) {
        const Group e(slots, base);
        finish_at(e, begin(e), {});
      }
      return;
    }
    // Ways through grids differ much in length: those of many paths are walked together.
    for (size_t chunk = 0; chunk < slots.size(); chunk += kWaysAtOnce) {
      const size_t end = std::min(chunk + kWaysAtOnce, slots.size());
      m_.ways.clear();
      for (size_t base = chunk; base < end; base += kLanes) {
        const Group e(slots, base);
        add_ways(e, begin(e));
      }
      walk_through_volumes(scene_, shines_ && !scene_.volumes.drawn.empty(), &m_.ways);
      size_t next = 0;
      for (size_t base = chunk; base < end; base += kLanes) {
        const Group e(slots, base);
        const Segment s = begin(e);
        finish_at(e, s, take_ways(m_.ways, &next, s.varies));
      }
    }
  }

 private:
  SampleStream<Lane> stream_of(LaneInt slot) const {
    return kLight ? layer_.light_stream<Lane>(slot) : layer_.camera_stream<Lane>(slot);
  }

  Segment begin(const Group& e) const {
    Segment g;
    g.path = load_paths<Lane>(w_.paths, e.slot);
    const PathLanes<Lane>& path = g.path;
    if (first_) {
      const SampleStream<Lane> stream = stream_of(e.slot);
      const uint32_t dim = vertex_dim(depth_, kLight ? kDimLightDistance : kDimCameraDistance);
      draw_depths(stream, dim, path.throughput, &g.channel, &g.left);
      if (scene_.any_panes) g.pane_draw = stream.get_1d(vertex_dim(depth_, kDimPane));
    } else {
      g.left = gather(m_.left, e.slot);
      g.channel = gather(m_.channel, e.slot);
      g.optical = gather_rgb(m_.depth, e.slot);
      g.rate = gather_rgb(m_.rate, e.slot);
      g.pane_draw = gather(m_.pane_draw, e.slot);
      g.panes = gather(m_.panes, e.slot);
      if (grids_) g.nulls = gather_rgb(m_.nulls, e.slot), g.drawn = gather(m_.drawn, e.slot);
    }
    const Vec3<Lane>&o = path.origin, &d = path.direction;
    g.hit = mask_and(e.active, LaneMask(path.prim >= 0));
    if (any(g.hit)) {
      g.s = surfaces(scene_, path.prim, path.instance, g.hit, o, d, times_of_slots(scene_, w_.paths, e.slot));
      g.sides = gather(scene_.primitive_media.data(), select(g.hit, path.prim, LaneInt{}));
      const Vec3<Lane> segment = g.s.p - o;
      g.far = sqrt(dot(segment, segment));
    }
    const Outermost outermost(scene_, o, d);
    g.far = select(g.hit, g.far, outermost.leave);
    if (kLight && depth_ == 1 && first_ && context_.lights.any_infinite()) {
      const LaneInt type = gather(context_.lights.type.data(), path.light);
      const LaneMask infinite = mask_or(LaneMask(type == kInfiniteLight), LaneMask(type == kDistantLight));
      g.near = select(infinite, outermost.enter, Lane{});
    }
    const MediumRecord<Lane> medium(scene_.media.data(), path.medium);
    g.varies = grids_ ? mask_and(e.active, LaneMask(medium.grid() != 0)) : splat_mask<Lane>(false);
    return g;
  }

  void add_ways(const Group& e, const Segment& g) {
    if (!any(g.varies)) return;
    VolumeWay<Lane> way{.medium = g.path.medium,
                        .origin = g.path.origin,
                        .direction = g.path.direction,
                        .from = g.near,
                        .until = g.far,
                        .length = sqrt(dot(g.path.direction, g.path.direction)),
                        .seed = as_int(stream_of(e.slot).get_seed(vertex_dim(depth_, kDimVolume))),
                        .channel = g.channel,
                        .throughput = g.path.throughput,
                        .start = segment_start(m_, e.slot),
                        .panes = g.panes,
                        .drawn = g.drawn,
                        .left = g.left,
                        .optical = g.optical,
                        .rate = g.rate,
                        .nulls = g.nulls};
    if (shines_) compete(context_, depth_, g.varies, g.path, &way);
    take_to_rest(scene_, g.varies, times_of_slots(scene_, w_.paths, e.slot), &way);
    append_ways(way, g.varies, &m_.ways);
  }

  /// `found`: on the ways of the lanes that vary.
  LaneMask finish(const Group& e, Segment g, const VolumeWay<Lane>& found) {
    PathLanes<Lane>& path = g.path;
    const MediumRecord<Lane> medium(scene_.media.data(), path.medium);
    const LaneMask even = mask_and(LaneMask(path.medium != 0), mask_not(g.varies));
    const Lane length = select(even, max(g.far - g.near, Lane{}), Lane{});
    const Lane chosen = medium.channel(kMediumCollision, g.channel);
    LaneMask collides = mask_and(e.active, LaneMask(chosen * length > g.left));
    Lane travelled = select(collides, g.left / select(collides, chosen, splat<Lane>(1.0f)), length);
    g.optical = g.optical + medium.rgb(kMediumExtinction) * travelled;
    g.rate = g.rate + medium.rgb(kMediumCollision) * travelled;
    g.left = max(g.left - chosen * length, Lane{});

    // Coefficients where the segment ends, if in a medium.
    Vec3<Lane> mu = medium.rgb(kMediumCollision), scattering = medium.rgb(kMediumScattering);
    if (any(g.varies)) {
      if (shines_) add_grid_glow(depth_, e.slot, g.varies, path.medium, found, path.dvc, context_, w_);
      g.left = select(g.varies, found.left, g.left);
      g.drawn = select(g.varies, found.drawn, g.drawn);
      g.optical = select(g.varies, found.optical, g.optical);
      g.rate = select(g.varies, found.rate, g.rate);
      g.nulls = select(g.varies, found.nulls, g.nulls);
      const LaneMask ends = mask_and(g.varies, LaneMask(found.collides != 0));
      collides = mask_or(collides, ends);
      travelled = select(ends, found.at - g.near, travelled);
      mu = select(ends, found.end_rate, mu);
      scattering = select(ends, found.end_scattering, scattering);
    }
    const LaneMask crosses = cross(e, collides, &g);
    const LaneMask done = mask_and(e.active, mask_not(crosses));
    if (!any(done)) return crosses;

    // At the segment's end: its weight, and P~.
    Vec3<Lane> passed = exp_minus(g.rate), transmitted = exp_minus(g.optical);
    if (grids_) passed = passed * g.nulls, transmitted = transmitted * g.nulls;
    const Vec3<Lane> share = channel_shares(path.throughput);
    const Lane density = select(collides, dot(share, mu * passed), dot(share, passed));
    const Lane inv = 1.0f / select(LaneMask(density > 0.0f), density, splat<Lane>(1.0f));
    const Vec3<Lane> arrived = path.throughput * transmitted * inv;
    if (shines_ && any(collides)) {
      const Vec3<Lane> shown = arrived * medium.rgb(kMediumEmission);
      const LaneMask shining = mask_and(collides, mask_not(LaneMask(max_component(shown) <= 0.0f)));
      add_glow(depth_, e.slot, mask_and(shining, mask_not(g.varies)), path.medium, shown, splat<Lane>(1.0f),
               {}, context_, w_);
    }
    path.throughput = select(collides, arrived * scattering, arrived);
    path.dvcm = path.dvcm / (mean(passed) * g.panes);  // M3
    path.prim = select(collides, splat_int<Lane>(kInMedium), path.prim);
    const Vec3<Lane> end = path.origin + path.direction * (g.near + travelled);
    store_paths(path, e.slot, mask_bits(done), &w_.paths);
    scatter_rgb(m_.end, e.slot, end, mask_and(done, collides));
    scatter(m_.end_rate, e.slot, select(g.varies, mean(mu), medium.scalar(kMediumMeanRate)),
            mask_and(done, collides));
    return crosses;
  }

  /// Stores the next rays of those that pass a boundary, and returns which do.
  LaneMask cross(const Group& e, LaneMask collides, Segment* g) {
    const PathLanes<Lane>& path = g->path;
    const Surface<Lane>& s = g->s;
    LaneMask crosses = mask_and(mask_and(g->hit, LaneMask(g->sides < 0)), mask_not(collides));
    if (scene_.any_panes && any(crosses)) {
      Vec3<Lane> optical = g->optical;
      const Lane passed = g->panes * pane_transmittance<Lane>(scene_, path.prim, crosses,
                                                              abs(dot(s.ng, path.direction)), s, &optical);
      crosses = mask_and(crosses, LaneMask(g->pane_draw < passed));
      g->panes = select(crosses, passed, g->panes);
      g->optical = select(crosses, optical, g->optical);
    }
    if (!any(crosses)) return crosses;
    const LaneMask out = LaneMask(dot(s.ng, path.direction) > 0.0f);
    PathLanes<Lane> next = path;
    next.origin = offset_origin(s.p, s.error, s.ng, path.direction);
    next.medium = medium_on_side<Lane>(sides_met<Lane>(g->sides, path.medium), out);
    store_paths(next, e.slot, mask_bits(crosses), &w_.paths);
    scatter(m_.left, e.slot, g->left, crosses);
    scatter(m_.channel, e.slot, g->channel, crosses);
    scatter_rgb(m_.depth, e.slot, g->optical, crosses);
    scatter_rgb(m_.rate, e.slot, g->rate, crosses);
    scatter(m_.pane_draw, e.slot, g->pane_draw, crosses);
    scatter(m_.panes, e.slot, g->panes, crosses);
    if (grids_) {
      scatter_rgb(m_.nulls, e.slot, g->nulls, crosses);
      scatter(m_.drawn, e.slot, g->drawn, crosses);
    }
    return crosses;
  }

  const StageContext& context_;
  const RenderScene& scene_;
  const LayerContext& layer_;
  int depth_;
  bool first_, grids_, shines_;
  Wavefront& w_;
  MediaWork& m_;
};

template <bool kLight>
void cast(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  const RenderScene& scene = context.scene;
  MediaWork& m = *w.media;
  Paths& paths = w.paths;
  if (w.probe) w.probe->cast(paths);
  const StageScope scope(w, Stage::kCast);
  m.casting.assign(paths.active, paths.active + paths.active_count);
  for (const int32_t slot : m.casting) {
    const auto i = static_cast<size_t>(slot);
    for (size_t axis = 0; axis < 3; ++axis) m.start[axis][i] = paths.rays[i].origin[axis];
    const float* t = &paths.carried[i][Paths::kThroughput];
    m.before[i] = std::max({t[0], t[1], t[2]});
  }
  for (bool first = true; !m.casting.empty(); first = false) {
    const auto count = static_cast<int>(m.casting.size());
    context.accel.closest_hits(paths.rays, m.casting.data(), count, times_of_rays(scene, paths),
                               kLight ? KindsOfRays{} : kinds_of_camera_rays(scene, paths));
    w.counters.closest_hit_rays += static_cast<uint64_t>(count);
    // Most paths of most scenes are in empty space and meet a surface: nothing is left to do for them.
    m.walking.clear();
    for (const int32_t slot : m.casting) {
      const int32_t prim = paths.rays[slot].prim;
      const bool boundary = prim >= 0 && scene.primitive_media[static_cast<size_t>(prim)] < 0;
      const auto medium = std::bit_cast<int32_t>(paths.carried[slot][Paths::kMedium]);
      if (!first || boundary || medium != 0) m.walking.push_back(slot);
    }
    m.casting.clear();
    Step<kLight>(context, layer, depth, first, w).run(m.walking, &m.casting);
  }
}

}  // namespace

void cast_light_paths_through_media(const StageContext& context, const LayerContext& layer, int depth,
                                    Wavefront& w) {
  cast<true>(context, layer, depth, w);
}
void cast_camera_paths_through_media(const StageContext& context, const LayerContext& layer, int depth,
                                     Wavefront& w) {
  cast<false>(context, layer, depth, w);
}

}  // namespace lightmill
