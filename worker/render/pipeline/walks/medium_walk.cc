#include "worker/render/pipeline/walks/medium_walk.h"

#include <bit>

#include "worker/render/light/direct_sampling.h"
#include "worker/render/pipeline/lane_group.h"
#include "worker/render/pipeline/paths/path_io.h"
#include "worker/render/pipeline/paths/path_radiance.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/paths/path_vertex.h"
#include "worker/render/pipeline/recording/stage_probe.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/pipeline/walks/medium_lanes.h"
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

/// Adds what media emit, times the path's throughput and weight, to the paths in `mask`. `ratios`: of the
/// other strategies.
void add_glow(int depth, LaneInt slot, LaneMask mask, Vec3<Lane> glow, Lane mis, FamilyRatios ratios,
              const StageContext& context, Wavefront& w) {
  if (!any(mask)) return;
  glow = glow * splat<Lane>(context.imaging_ratio);
  add_radiance(w, slot, mask, glow);
  if (!w.recorder) return;
  add_ratio(&ratios, &FamilyShares::hit, splat<Lane>(1.0f));
  w.recorder->emission(depth + 1, slot, mask, glow, mis, ratios);
}

/// The same of what was found in grids. Weights differ from point to point: what is recorded is their mean.
void add_grid_glow(int depth, LaneInt slot, LaneMask mask, const VolumeCollision& found, Lane dvc,
                   const StageContext& context, Wavefront& w) {
  const Lane weighted = found.glow.x + found.glow.y + found.glow.z;
  const LaneMask shines = mask_and(mask, mask_not(LaneMask(weighted <= 0.0f)));
  const Lane mis = select(shines, weighted / found.all_glow, splat<Lane>(1.0f));
  FamilyRatios ratios{};
  if (w.recorder) {
    const Lane inv = select(LaneMask(weighted > 0x1p-100f), 1.0f / weighted, Lane{});  // else lost anyway
    const Lane light_paths = found.light_path_glow * inv;
    add_ratio(&ratios, &FamilyShares::next_event, max(found.all_glow * inv - 1.0f - light_paths, Lane{}));
    const LaneMask joined = mask_and(shines, LaneMask(dvc > 0.0f));
    w.recorder->add_camera_path(
        slot, select(joined, light_paths / select(joined, dvc, splat<Lane>(1.0f)), Lane{}), dvc, &ratios);
  }
  add_glow(depth, slot, shines, found.glow, mis, ratios, context, w);
}

/// What is wanted of the emission that the segments of `path` meet.
GlowSight glow_sight(const StageContext& context, int depth, LaneInt slot, LaneMask varies, Lane panes,
                     const PathLanes<Lane>& path, const MediaWork& m) {
  GlowSight sight{.wanted = context.on(kEmissionHits) && !context.scene.volumes.drawn.empty(),
                  .start = segment_start(m, slot),
                  .panes = panes};
  // What the camera sees directly nothing else finds.
  if (!sight.wanted || depth == 1) return sight;
  const RenderScene& scene = context.scene;
  const LaneInt grid = MediumRecord<Lane>(scene.media.data(), select(varies, path.medium, LaneInt{})).grid();
  const LaneInt record = select(varies, (grid - 1) * kGridFloats, LaneInt{});
  const LaneInt light =
      gather(reinterpret_cast<const int32_t*>(scene.volumes.records.data()) + kGridLight, record);
  const LaneMask shines = mask_and(varies, LaneMask(light >= 0));
  if (!any(shines)) return sight;
  const LaneInt of = select(shines, light, LaneInt{});
  if (context.on(kNextEvent)) {
    const Lane chosen = direct_selection<Lane>(context.lights, of, sight.start, shines);
    sight.next_event = select(shines, chosen * path.dvcm, Lane{});
  }
  if (context.on(kLightPaths) && depth - 1 <= kMaxLightVertices) {
    const Lane chosen = LightRecord<Lane>(context.lights, of).scalar(kLightSelect);
    sight.light_paths = select(shines, chosen * path.dvc * (1 / (4 * kPi)), Lane{});
  }
  return sight;
}

/// One step of the walk for `e`: as far as the next surface, boundary or collision. Returns the lanes at a
/// boundary, whose next ray is stored.
template <bool kLight>
LaneMask step(const StageContext& context, const LayerContext& layer, int depth, bool first, const Group& e,
              Wavefront& w) {
  const RenderScene& scene = context.scene;
  MediaWork& m = *w.media;
  PathLanes<Lane> path = load_paths<Lane>(w.paths, e.slot);
  const Vec3<Lane>&o = path.origin, &d = path.direction;
  Lane left;
  LaneInt channel;
  Vec3<Lane> optical{}, rate{}, nulls = splat3<Lane>(1, 1, 1);
  LaneInt drawn{};
  Lane pane_draw{}, panes = splat<Lane>(1.0f);
  const bool grids = !scene.volumes.empty();
  const SampleStream<Lane> stream =
      kLight ? layer.light_stream<Lane>(e.slot) : layer.camera_stream<Lane>(e.slot);
  if (first) {
    const uint32_t dim = vertex_dim(depth, kLight ? kDimLightDistance : kDimCameraDistance);
    draw_depths(stream, dim, path.throughput, &channel, &left);
    if (scene.any_panes) pane_draw = stream.get_1d(vertex_dim(depth, kDimPane));
  } else {
    left = gather(m.left, e.slot);
    channel = gather(m.channel, e.slot);
    optical = gather_rgb(m.depth, e.slot);
    rate = gather_rgb(m.rate, e.slot);
    pane_draw = gather(m.pane_draw, e.slot);
    panes = gather(m.panes, e.slot);
    if (grids) nulls = gather_rgb(m.nulls, e.slot), drawn = gather(m.drawn, e.slot);
  }

  const LaneMask hit = mask_and(e.active, LaneMask(path.prim >= 0));
  Surface<Lane> s{};
  LaneInt sides{};
  Lane far{};
  if (any(hit)) {
    s = surfaces(scene, path.prim, path.instance, hit, o, d, times_of_slots(scene, w.paths, e.slot));
    sides = gather(scene.primitive_media.data(), select(hit, path.prim, LaneInt{}));
    const Vec3<Lane> segment = s.p - o;
    far = sqrt(dot(segment, segment));
  }
  const LaneMask filled = LaneMask(path.medium != 0);
  const Outermost outermost(scene, o, d);
  far = select(hit, far, outermost.leave);
  Lane near{};
  if (kLight && depth == 1 && first && context.lights.any_infinite()) {
    const LaneInt type = gather(context.lights.type.data(), path.light);
    const LaneMask infinite = mask_or(LaneMask(type == kInfiniteLight), LaneMask(type == kDistantLight));
    near = select(infinite, outermost.enter, Lane{});
  }
  const MediumRecord<Lane> medium(scene.media.data(), path.medium);
  const LaneMask varies = grids ? mask_and(e.active, LaneMask(medium.grid() != 0)) : splat_mask<Lane>(false);
  const Lane length = select(mask_and(filled, mask_not(varies)), max(far - near, Lane{}), Lane{});

  const Lane chosen = medium.channel(kMediumCollision, channel);
  LaneMask collides = mask_and(e.active, LaneMask(chosen * length > left));
  Lane travelled = select(collides, left / select(collides, chosen, splat<Lane>(1.0f)), length);
  optical = optical + medium.rgb(kMediumExtinction) * travelled;
  rate = rate + medium.rgb(kMediumCollision) * travelled;
  left = max(left - chosen * length, Lane{});

  // Coefficients where the segment ends, if in a medium.
  Vec3<Lane> mu = medium.rgb(kMediumCollision), scattering = medium.rgb(kMediumScattering);
  const bool shines = !kLight && context.on(kEmissionHits);
  if (any(varies)) {
    VolumeWalk walk{.active = varies,
                    .medium = path.medium,
                    .origin = o,
                    .direction = d,
                    .from = near,
                    .until = far,
                    .seed = stream.get_seed(vertex_dim(depth, kDimVolume)),
                    .drawn = drawn,
                    .left = left,
                    .optical = optical,
                    .rate = rate,
                    .nulls = nulls};
    const GlowSight sight = kLight ? GlowSight() : glow_sight(context, depth, e.slot, varies, panes, path, m);
    const VolumeCollision found = walk_through_volumes(scene, channel, path.throughput, sight, &walk);
    if (shines) add_grid_glow(depth, e.slot, varies, found, path.dvc, context, w);
    left = select(varies, walk.left, left);
    drawn = walk.drawn;
    optical = select(varies, walk.optical, optical);
    rate = select(varies, walk.rate, rate);
    nulls = walk.nulls;
    collides = mask_or(collides, found.collides);
    travelled = select(found.collides, found.at - near, travelled);
    mu = select(found.collides, found.rate, mu);
    scattering = select(found.collides, found.scattering, scattering);
  }

  LaneMask crosses = mask_and(mask_and(hit, LaneMask(sides < 0)), mask_not(collides));
  if (scene.any_panes && any(crosses)) {
    const Lane passed = panes * pane_transmittance<Lane>(scene, path.prim, crosses, abs(dot(s.ng, d)));
    crosses = mask_and(crosses, LaneMask(pane_draw < passed));
    panes = select(crosses, passed, panes);
  }
  if (any(crosses)) {
    const LaneMask out = LaneMask(dot(s.ng, d) > 0.0f);
    PathLanes<Lane> next = path;
    next.origin = offset_origin(s.p, s.error, s.ng, d);
    next.medium = medium_on_side<Lane>(sides_met<Lane>(sides, path.medium), out);
    store_paths(next, e.slot, mask_bits(crosses), &w.paths);
    scatter(m.left, e.slot, left, crosses);
    scatter(m.channel, e.slot, channel, crosses);
    scatter_rgb(m.depth, e.slot, optical, crosses);
    scatter_rgb(m.rate, e.slot, rate, crosses);
    scatter(m.pane_draw, e.slot, pane_draw, crosses);
    scatter(m.panes, e.slot, panes, crosses);
    if (grids) {
      scatter_rgb(m.nulls, e.slot, nulls, crosses);
      scatter(m.drawn, e.slot, drawn, crosses);
    }
  }
  const LaneMask done = mask_and(e.active, mask_not(crosses));
  if (!any(done)) return crosses;

  // At the segment's end: its weight, and P~.
  Vec3<Lane> passed = exp_minus(rate), transmitted = exp_minus(optical);
  if (grids) passed = passed * nulls, transmitted = transmitted * nulls;
  const Vec3<Lane> share = channel_shares(path.throughput);
  const Lane density = select(collides, dot(share, mu * passed), dot(share, passed));
  const Lane inv = 1.0f / select(LaneMask(density > 0.0f), density, splat<Lane>(1.0f));
  const Vec3<Lane> arrived = path.throughput * transmitted * inv;
  if (shines && any(collides)) {
    const Vec3<Lane> shown = arrived * medium.rgb(kMediumEmission);
    const LaneMask shining = mask_and(collides, mask_not(LaneMask(max_component(shown) <= 0.0f)));
    add_glow(depth, e.slot, mask_and(shining, mask_not(varies)), shown, splat<Lane>(1.0f), {}, context, w);
  }
  path.throughput = select(collides, arrived * scattering, arrived);
  path.dvcm = path.dvcm / (mean(passed) * panes);  // M3
  path.prim = select(collides, splat_int<Lane>(kInMedium), path.prim);
  store_paths(path, e.slot, mask_bits(done), &w.paths);
  scatter_rgb(m.end, e.slot, o + d * (near + travelled), mask_and(done, collides));
  scatter(m.end_rate, e.slot, select(varies, mean(mu), medium.scalar(kMediumMeanRate)),
          mask_and(done, collides));
  return crosses;
}

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
    context.accel.closest_hits(paths.rays, m.casting.data(), count, times_of_rays(scene, paths));
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
    for (size_t base = 0; base < m.walking.size(); base += kLanes) {
      const Group e(m.walking, base);
      append(&m.casting, e.slot, step<kLight>(context, layer, depth, first, e, w));
    }
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
