#include "worker/render/pipeline/connections/manifold_next_event.h"

#include <limits>

#include "worker/render/guiding/manifold_targets.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/pipeline/connections/emitter_hits.h"
#include "worker/render/pipeline/connections/joined_vertices.h"
#include "worker/render/pipeline/connections/shadow_queue.h"
#include "worker/render/pipeline/walks/manifold_walk.h"

namespace lightmill {
namespace {

using Groups = std::array<const ManifoldGroup*, kLanes>;
using K = SurfaceKernels;

/// Independent uniform numbers by which a vertex's light and its point are chosen.
struct ManifoldChoice {
  Lane light{}, u{}, v{};
};

/// Whether only a path that hits the light could go on from the vertex by mirrors and glass: no light path is
/// joined to it or to the vertex before.
bool is_alone(const StageContext& context, const Vertex& v) {
  return !context.on(kLightPaths) || (v.f[Vertex::kDvcm] == 0 && v.f[Vertex::kDvc] == 0);
}

ChainStart start_of(const VertexLanes<Lane>& v, Lane time) {
  return {.p = v.p, .ng = v.ng, .error = v.error, .time = time};
}

/// The lanes whose last segment of `way` is free.
LaneMask free_lanes(const StageContext& context, const WalkEnd& way, const LightTarget<Lane>& target,
                    Lane time, LaneMask active, RenderCounters* counters) {
  const Vec3<Lane> end = offset_origin(target.at, target.error, target.normal, -way.direction);
  const Vec3<Lane> d = select(target.infinite, target.at, end - way.origin);
  const Lane tfar =
      select(target.infinite, splat<Lane>(std::numeric_limits<float>::infinity()), splat<Lane>(kSegmentEnd));
  alignas(32) std::array<std::array<float, kLanes>, 8> rays;
  int count = 0;
  std::array<int, kLanes> lanes{};
  for (unsigned bits = mask_bits(active); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const auto i = static_cast<size_t>(count);
    const std::array<Lane, 8> all{way.origin.x, way.origin.y, way.origin.z, d.x, d.y, d.z, tfar, time};
    for (size_t k = 0; k < all.size(); ++k) rays[k][i] = lane(all[k], l);
    lanes[static_cast<size_t>(count++)] = l;
  }
  std::array<uint8_t, kLanes> occluded{};
  const RayView view{rays[0].data(),
                     rays[1].data(),
                     rays[2].data(),
                     rays[3].data(),
                     rays[4].data(),
                     rays[5].data(),
                     context.scene.any_moving() ? rays[7].data() : nullptr};
  context.accel.occluded(view, rays[6].data(), count, occluded.data());
  counters->shadow_rays += static_cast<uint64_t>(count);
  LaneMask free = active;
  for (int i = 0; i < count; ++i) {
    if (occluded[static_cast<size_t>(i)]) set_lane(&free, lanes[static_cast<size_t>(i)], 0);
  }
  return free;
}

/// Calls add(lanes, contribution, events, light, wo, wi) with the light that comes to `vertices` by all ways
/// from one light each. Directions are local.
template <class Add>
void for_each_contribution(const StageContext& context, const VertexLanes<Lane>& vertices, Lane time,
                           LaneMask active, const ManifoldChoice& choice, LaneInt most_events,
                           ManifoldWork& work, RenderCounters* counters, Add&& add) {
  const LightTable& lights = context.lights;
  work.rays = LaneInt{};
  Groups groups{};
  LaneInt light{};
  Lane inv_choice{};
  Vec3<Lane> axis;
  for (unsigned bits = mask_bits(active); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    float left = lane(choice.light, l);
    const Vec3<float> p{lane(vertices.p.x, l), lane(vertices.p.y, l), lane(vertices.p.z, l)};
    const ManifoldGroup* group = group_at(context.scene.manifolds, p, [&](const ManifoldGroup& g, bool last) {
      left -= g.probability;
      return left < 0 || last;
    });
    groups[static_cast<size_t>(l)] = group;
    if (!group) continue;
    set_lane(&light, l, group->light);
    set_lane(&inv_choice, l, 1 / group->probability);
    set_lane(&axis, l, group->axis);
  }
  const LightTarget<Lane> target = sample_target<Lane>(lights, light, axis, choice.u, choice.v);
  const Frame<Lane> frame(vertices.ns);
  const Vec3<Lane> wo = local_viewer(context, vertices, frame, vertices.wo);
  for_each_way(context, start_of(vertices, time), active, groups, most_events, {target.at, target.infinite},
               work.chains, counters, [&](const WalkEnd& way) {
                 work.rays = work.rays + way.rays;
                 const LaneMask sees = mask_and(way.found, consistent<K>(vertices, way.w));
                 if (!any(sees)) return;
                 const Vec3<Lane> wi = frame.to_local(way.w);
                 const BsdfEval<Lane> f =
                     eval_bsdf<Lane>(vertices.kind, sees, vertices.params, wo, wi, Mode::kRadiance);
                 const Vec3<Lane> c = vertices.throughput * f.f * way.throughput *
                                      target_light(lights, light, target, way.direction) *
                                      (abs(wi.z) * way.density * target.inv_pdf * inv_choice);
                 // NaN goes on, and is counted where it would be added.
                 const Lane size = max_component(c);
                 LaneMask adds = mask_and(sees, mask_not(LaneMask(size <= 0.0f)));
                 if (!any(adds)) return;
                 adds = free_lanes(context, way, target, time, adds, counters);
                 add(adds, c, way.events, light, wo, wi);
               });
}

/// Records them like emitter hits, with the share of a family that is in every plan.
void record(const StageContext& context, int depth, LaneInt slot, LaneMask adds, const Vec3<Lane>& c,
            LaneInt events, Wavefront& w) {
  FamilyRatios ratios{};
  add_ratio(&ratios, context.on(kNextEvent) ? &FamilyShares::next_event : &FamilyShares::hit,
            splat<Lane>(1.0f));
  for (unsigned bits = mask_bits(adds); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const int t = depth + SpecularEvents::count_of(lane(events, l)) + 2;
    w.recorder->emission(t, slot, LaneMask(lane_index<Lane>() == l), c, splat<Lane>(1.0f), ratios);
  }
}

/// Counts the rays of walks in what the paths cost.
void add_rays(LaneInt slot, LaneMask active, LaneInt rays, StrategyRecorder* recorder) {
  for (unsigned bits = mask_bits(active); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    recorder->hits_of_path[static_cast<size_t>(lane(slot, l))] += static_cast<uint32_t>(lane(rays, l));
  }
}

}  // namespace

void begin_manifolds(const StageContext& context, Wavefront& w) {
  if (context.scene.manifolds.empty()) return;
  if (!w.manifolds) w.manifolds = std::make_shared<ManifoldWork>();
  w.manifolds->waits.fill(false);
}

void connect_manifolds(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  const ManifoldSeeds& seeds = context.scene.manifolds;
  if (seeds.empty() || w.vertices.empty()) return;
  ManifoldWork& work = *w.manifolds;
  work.joined.clear();
  for (size_t i = 0; i < w.vertices.size(); ++i) {
    const Vertex& v = w.vertices[i];
    const auto path = static_cast<size_t>(v.path());
    work.waits[path] = false;
    if (!is_alone(context, v) || depth >= context.max_depth) continue;
    const ManifoldSeeds::Table* table = seeds.at(v.vec(Vertex::kP));
    if (!table) continue;
    work.chance[i] = seeds.chance(*table, max_component(v.vec(Vertex::kThroughput)));
    // The number that chooses the light says first whether there is a walk.
    const SampleStream<float> stream = layer.camera_stream<float>(v.path());
    if (stream.get_1d(vertex_dim(depth, kDimManifoldLight)) < work.chance[i])
      work.joined.push_back(static_cast<int32_t>(i));
    // A path that leaves by a delta lobe goes a way of its own.
    if (!seeds.meetable || w.paths.carried[path][Paths::kDvcm] == 0) continue;
    work.waits[path] = true;
    work.vertex[path] = v;
    const float* d = w.paths.rays[path].direction;
    work.direction[path] = {d[0], d[1], d[2]};
  }
  for (size_t base = 0; base < work.joined.size(); base += kLanes) {
    const Group g(work.joined, base);
    VertexLanes<Lane> v = load_vertices(w.vertices.data(), g.slot);
    v.params.tables = context.scene.bsdf_tables.data();
    const SampleStream<Lane> stream = layer.camera_stream<Lane>(v.path);
    ManifoldChoice choice;
    stream.get_2d(vertex_dim(depth, kDimManifoldPoint), &choice.u, &choice.v);
    const Lane chance = gather(work.chance.data(), g.slot);
    choice.light = stream.get_1d(vertex_dim(depth, kDimManifoldLight)) / chance;
    for_each_contribution(context, v, times_of_slots(context.scene, w.paths, v.path), g.active, choice,
                          splat_int<Lane>(context.max_depth - depth), work, &w.counters,
                          [&](LaneMask adds, Vec3<Lane> c, LaneInt events, LaneInt light,
                              const Vec3<Lane>& wo, const Vec3<Lane>& wi) {
                            c = c * (splat<Lane>(context.imaging_ratio) / chance);
                            add_radiance(w, v.path, adds, c, groups_of(w, context.lights, light),
                                         lobes_of_join(w.lobes, v, adds, wo, wi, depth, false));
                            if (w.recorder) record(context, depth, v.path, adds, c, events, w);
                          });
    if (w.recorder) add_rays(v.path, g.active, work.rays, w.recorder);
  }
}

LaneMask counted_by_manifolds(const StageContext& context, LaneInt slot, LaneMask meets, LaneInt light,
                              const Vec3<Lane>& at, LaneMask infinite, int depth, Wavefront& w) {
  ManifoldWork& work = *w.manifolds;
  const ManifoldSeeds& seeds = context.scene.manifolds;
  Groups groups{};
  LaneMask asks = splat_mask<Lane>(false);
  LaneInt index{}, events{};
  Vec3<Lane> left, axis;
  for (unsigned bits = mask_bits(meets); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const auto path = static_cast<size_t>(lane(slot, l));
    if (!work.waits[path]) continue;
    const Vertex& v = work.vertex[path];
    const ManifoldGroup* group = group_at(
        seeds, v.vec(Vertex::kP), [&](const ManifoldGroup& g, bool) { return g.light == lane(light, l); });
    const int passed = depth - 1 - v.depth();
    if (!group || passed == 0) continue;
    groups[static_cast<size_t>(l)] = group;
    set_lane(&asks, l, -1);
    set_lane(&index, l, static_cast<int32_t>(path));
    set_lane(&events, l, passed);
    set_lane(&left, l, work.direction[path]);
    set_lane(&axis, l, group->axis);
  }
  LaneMask counted = splat_mask<Lane>(false);
  asks = mask_and(asks, is_target<Lane>(context.lights, light, axis, at));
  if (!any(asks)) return counted;
  const VertexLanes<Lane> v = load_vertices(work.vertex.data(), index);
  const LaneInt most_events = splat_int<Lane>(context.max_depth) - v.depth;
  for_each_way(context, start_of(v, times_of_slots(context.scene, w.paths, slot)), asks, groups, most_events,
               {at, infinite}, work.chains, &w.counters, [&](const WalkEnd& way) {
                 const LaneMask same = mask_and(way.found, same_direction(way.w, left));
                 counted = mask_or(counted,
                                   mask_and(same, LaneMask(SpecularEvents::count_of(way.events) == events)));
               });
  return counted;
}

}  // namespace lightmill
