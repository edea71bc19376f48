#include "worker/render/pipeline/bouncer.h"

#include "worker/render/math/compress.h"
#include "worker/render/pipeline/connections/emitter_hits.h"
#include "worker/render/pipeline/connections/lamp_hits.h"
#include "worker/render/pipeline/paths/path_scatter.h"
#include "worker/render/pipeline/recording/aov_recorder.h"

namespace lightmill {
namespace {

/// Where the sorted paths end: first the hits, then those in media, then those that escaped.
struct Ends {
  int hits = 0, collisions = 0;  // ends of the first two ranges
};

/// If there is nothing to group, only the misses go last, in order.
Ends misses_last(Wavefront& w) {
  Paths& p = w.paths;
  int hits = 0;
  w.sorted.clear();
  for (int i = 0; i < p.active_count; ++i) {
    const int32_t slot = p.active[i];
    if (p.rays[slot].prim >= 0) {
      p.active[hits++] = slot;
    } else {
      w.sorted.push_back(slot);
    }
  }
  std::copy(w.sorted.begin(), w.sorted.end(), p.active + hits);
  return {hits, hits};
}

/// Counting sort of the active slots by BSDF kind, collisions and misses last. With media w.sorted keeps a
/// copy.
template <class K>
Ends sort_paths(const RenderScene& scene, Wavefront& w) {
  if (!K::kSurfaces || (!K::kMedia && scene.kinds_present <= 1)) return misses_last(w);
  constexpr int kCollided = kMaterialKinds, kEscaped = kMaterialKinds + 1;
  Paths& p = w.paths;
  int count[kEscaped + 2] = {};
  uint8_t keys[kWavefront];
  for (int i = 0; i < p.active_count; ++i) {
    const int32_t prim = p.rays[p.active[i]].prim;
    int key = K::kMedia && prim == kInMedium ? kCollided : kEscaped;
    if (prim >= 0)
      key = scene.material_kind[static_cast<size_t>(scene.primitive_material[static_cast<size_t>(prim)])];
    keys[i] = static_cast<uint8_t>(key);
    ++count[key + 1];
  }
  for (int k = 0; k <= kEscaped; ++k) count[k + 1] += count[k];
  const Ends ends{count[kCollided], count[kEscaped]};
  w.sorted.resize(static_cast<size_t>(p.active_count));
  for (int i = 0; i < p.active_count; ++i) w.sorted[static_cast<size_t>(count[keys[i]]++)] = p.active[i];
  std::copy(w.sorted.begin(), w.sorted.end(), p.active);
  return ends;
}

void record_vertex(const Hit& h, const Group& g, bool light, int depth, Wavefront& w) {
  const LaneMask inconsistent = mask_and(g.active, mask_not(h.valid));
  w.recorder->inconsistent_hits += static_cast<uint64_t>(std::popcount(mask_bits(inconsistent)));
  if (w.recorder->trace)
    w.recorder->vertex(light, depth, g.slot, g.active, h.path.prim, h.v.p, h.v.throughput);
}

void append_survivors(LaneInt slot, LaneMask go, int32_t* out, int* count) {
  const unsigned bits = mask_bits(go);
  store_compressed(out + *count, slot, bits);
  *count += std::popcount(bits);
}

/// Calls meet(group, hit, stream) for all paths that have a vertex, eight at a time.
template <class K, class Meet>
void for_each_vertex(const RenderScene& scene, const LayerContext& layer, const Ends& ends, Mode mode,
                     int depth, Wavefront& w, Meet&& meet) {
  // Survivors are compacted into the active list while it is read, whole vectors at a time: they would run
  // over the end of a range that is not the last. sort_paths leaves a copy.
  const int32_t* slots = K::kMedia ? w.sorted.data() : w.paths.active;
  const auto stream_of = [&](const Group& g) {
    return mode == Mode::kImportance ? layer.light_stream<Lane>(g.slot) : layer.camera_stream<Lane>(g.slot);
  };
  for (int base = 0; base < ends.hits; base += kLanes) {
    const Group g(slots + base, std::min(kLanes, ends.hits - base));
    const SampleStream<Lane> stream = stream_of(g);
    Hit h = reconstruct<K>(scene, w, g, mode, depth, &stream);
    meet(g, h, stream);
  }
  if constexpr (K::kMedia) {
    for (int base = ends.hits; base < ends.collisions; base += kLanes) {
      const Group g(slots + base, std::min(kLanes, ends.collisions - base));
      Hit h = collision(scene, w, g, depth);
      meet(g, h, stream_of(g));
    }
  }
}

/// The vertices where paths leave the bodies that they entered at this depth: like other vertices, and at the
/// same depth. Calls leave(group, hit).
template <class K, class Leave>
void for_each_leaving(const StageContext& context, const LayerContext& layer, Mode mode, int depth,
                      Wavefront& w, Leave&& leave) {
  if constexpr (!K::kSurfaces) return;
  if (!context.scene.any_bodies) return;
  const bool light = mode == Mode::kImportance;
  walk_through_bodies(context, layer, light, depth, w);
  const std::vector<int32_t>& slots = w.bodies->leaving;
  const auto count = static_cast<int>(slots.size());
  for (int base = 0; base < count; base += kLanes) {
    const Group g(slots.data() + base, std::min(kLanes, count - base));
    Hit h = leave_body<K>(context.scene, w, g, mode, depth);
    if (recorder_of<K>(w)) record_vertex(h, g, light, depth, w);
    leave(g, h);
  }
}

template <class K>
void light_vertices(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  const RenderScene& scene = context.scene;
  Paths& paths = w.paths;
  const Ends ends = sort_paths<K>(scene, w);
  // A vertex at `depth` is the depth-th scattering event of a path that light tracing makes of it.
  const bool go_on = depth < context.max_depth && (context.lens_alone() || depth < kMaxLightVertices);
  int survivors = 0;
  const auto meet = [&](const Group& g, Hit& h, const SampleStream<Lane>& stream) {
    if (recorder_of<K>(w)) record_vertex(h, g, true, depth, w);
    // M3; the first segment also receives p_direct of M1.
    if (depth == 1) {
      const LaneInt light = h.path.light;
      const Lane cos_light = h.path.cos_light;
      h.v.dvcm = h.v.dvcm * direct_pdf_area<Lane, K::kLights>(context.lights, light, h.v.p, h.v.wo,
                                                              h.distance2, cos_light, g.active,
                                                              light_times<K>(context.lights, paths, g.slot));
      LaneMask finite = splat_mask<Lane>(true);
      if (K::kLights && (context.lights.any_infinite() || context.lights.any_facing)) {
        const LaneInt type = gather(context.lights.type.data(), light);
        finite = mask_and(LaneMask(type != kInfiniteLight), LaneMask(type != kDistantLight));
        finite = mask_and(finite, LaneMask(type != kFacingLamp));
      }
      h.v.dvcm = h.v.dvcm * select(finite, h.distance2, splat<Lane>(1.0f));
      // A surface before the portal does not see the light through it.
      h.valid = mask_and(h.valid, through_portals<Lane, K::kLights>(context.lights, light, h.v.p, h.v.wo));
      // Nor one beside the cone in which it would see the lamp.
      h.valid =
          mask_and(h.valid, in_facing_cones<Lane, K::kLights>(context.lights, light, h.v.p, h.v.wo,
                                                              light_times<K>(context.lights, paths, g.slot)));
    } else {
      h.v.dvcm = h.v.dvcm * h.distance2;
    }
    const Lane inv_cos = 1.0f / h.cos_in;
    h.v.dvcm = h.v.dvcm * inv_cos;
    h.v.dvc = h.v.dvc * inv_cos;
    // From here on dVCM stands for one strategy: joining the vertex before.
    h.v.dvcm =
        h.v.dvcm * (depth == 1 ? context.samples_of(kNextEvent) : context.samples_of(kVertexConnections));
    const LaneMask connectable = connectable_lanes<K>(h);
    add_guide(scene, connectable, &h.v);
    mark_unseen(scene, h.path, connectable, &h.v);
    if (w.groups) h.v.group = gather(w.groups->of_path, g.slot);
    if (StrategyRecorder* recorder = recorder_of<K>(w)) {
      recorder->hit(true, g.slot, g.active, inv_cos);
      recorder->store(true, w.light_vertices.size(), g.slot, connectable);
    }
    append_vertices(h.v, mask_bits(connectable), &w.light_vertices);
    // Entering a body and leaving it is one event.
    if (!go_on && !(K::kSurfaces && scene.any_bodies)) return;
    const LaneMask go = scatter_paths<K>(context, stream, h, h.valid, Mode::kImportance, depth, true, w);
    if (go_on) append_survivors(g.slot, go, paths.active, &survivors);
  };
  for_each_vertex<K>(scene, layer, ends, Mode::kImportance, depth, w, meet);
  for_each_leaving<K>(context, layer, Mode::kImportance, depth, w, [&](const Group& g, Hit& h) {
    mark_unseen(scene, h.path, h.valid, &h.v);
    if (w.groups) h.v.group = gather(w.groups->of_path, g.slot);
    if (StrategyRecorder* recorder = recorder_of<K>(w))
      recorder->store(true, w.light_vertices.size(), g.slot, h.valid);
    append_vertices(h.v, mask_bits(h.valid), &w.light_vertices);
    if (!go_on) return;
    const LaneMask go = scatter_paths<K>(context, layer.light_stream<Lane>(g.slot), h, h.valid,
                                         Mode::kImportance, depth, true, w);
    append_survivors(g.slot, go, paths.active, &survivors);
  });
  paths.active_count = survivors;
}

template <class K>
void camera_vertices(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  const RenderScene& scene = context.scene;
  Paths& paths = w.paths;
  w.vertices.clear();
  const Ends ends = sort_paths<K>(scene, w);
  // A path that ends here on an emitter has depth - 1 scattering events.
  const bool weigh_connections = context.on(kLightPaths) && depth - 1 <= kMaxLightVertices;
  const bool parallel = depth == 1 && is_parallel(context.camera);
  if (K::kLights && context.on(kEmissionHits) && !context.lights.infinite.empty()) {
    for (int base = ends.collisions; base < paths.active_count; base += kLanes) {
      add_environment<K>(context, Group(paths.active + base, std::min(kLanes, paths.active_count - base)),
                         depth, weigh_connections, w);
    }
  }
  const bool lamps = K::kLights && context.on(kEmissionHits) && !context.lights.lamps.empty();
  if (lamps) {
    for (int base = ends.collisions; base < paths.active_count; base += kLanes) {
      const Group g(paths.active + base, std::min(kLanes, paths.active_count - base));
      add_lamps<K>(context, g, load_paths<Lane>(paths, g.slot), splat<Lane>(kInfinity), depth,
                   weigh_connections, w);
    }
  }
  int survivors = 0;
  const auto meet = [&](const Group& g, Hit& h, const SampleStream<Lane>& stream) {
    const bool in_medium = K::kMedia && lane(h.v.kind, 0) == kPhaseFunction;
    if (recorder_of<K>(w)) record_vertex(h, g, false, depth, w);
    if (lamps) add_lamps<K>(context, g, h.path, sqrt(h.distance2), depth, weigh_connections, w);
    if (K::kObserved && w.aovs && !in_medium) w.aovs->hits(context, h, g.active, depth, w.paths);
    if (K::kObserved && w.aovs && in_medium) w.aovs->ends_in_medium(g.slot, g.active);
    const Lane inv_cos = 1.0f / h.cos_in;
    // M3; rays of a parallel camera don't spread with distance.
    h.v.dvcm = h.v.dvcm * (parallel ? splat<Lane>(1.0f) : h.distance2) * inv_cos;
    h.v.dvc = h.v.dvc * inv_cos;
    if (StrategyRecorder* recorder = recorder_of<K>(w)) recorder->hit(false, g.slot, g.active, inv_cos);
    if (context.on(kEmissionHits) && !in_medium)
      add_emission<K>(context, h, g.active, depth, weigh_connections, w);
    // From here on dVCM stands for one strategy: joining the vertex before. M2 brought light tracing's n_j.
    h.v.dvcm = h.v.dvcm * (depth > 1                   ? context.samples_of(kVertexConnections)
                           : context.on(kLightTracing) ? 1.0f
                                                       : 0.0f);
    if (depth > context.max_depth) return;
    const LaneMask connectable = connectable_lanes<K>(h);
    if (StrategyRecorder* recorder = recorder_of<K>(w))
      recorder->store(false, w.vertices.size(), g.slot, connectable);
    append_vertices(h.v, mask_bits(connectable), &w.vertices);
    const LaneMask go =
        scatter_paths<K>(context, stream, h, h.valid, Mode::kRadiance, depth, context.on(kLightPaths), w);
    append_survivors(g.slot, go, paths.active, &survivors);
  };
  for_each_vertex<K>(scene, layer, ends, Mode::kRadiance, depth, w, meet);
  for_each_leaving<K>(context, layer, Mode::kRadiance, depth, w, [&](const Group& g, const Hit& h) {
    if (StrategyRecorder* recorder = recorder_of<K>(w))
      recorder->store(false, w.vertices.size(), g.slot, h.valid);
    append_vertices(h.v, mask_bits(h.valid), &w.vertices);
    const LaneMask go = scatter_paths<K>(context, layer.camera_stream<Lane>(g.slot), h, h.valid,
                                         Mode::kRadiance, depth, context.on(kLightPaths), w);
    append_survivors(g.slot, go, paths.active, &survivors);
  });
  paths.active_count = survivors;
}

void prepare_bodies(const RenderScene& scene, Wavefront& w) {
  if (scene.any_bodies && !w.bodies) w.bodies = std::make_shared<BodyWalks>();
}

}  // namespace

void bounce_light_paths(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  prepare_bodies(context.scene, w);
  with_kernels(context.kernels.paths, w, [&]<class K>(K) { light_vertices<K>(context, layer, depth, w); });
}

void bounce_camera_paths(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  prepare_bodies(context.scene, w);
  with_kernels(context.kernels.paths, w, [&]<class K>(K) { camera_vertices<K>(context, layer, depth, w); });
}

}  // namespace lightmill
