#include "worker/render/pipeline/bouncer.h"

#include "worker/render/bsdf/bsdf_dispatch.h"
#include "worker/render/light/light_sampling.h"
#include "worker/render/math/compress.h"
#include "worker/render/pipeline/aov_recorder.h"
#include "worker/render/pipeline/kernel_choice.h"
#include "worker/render/pipeline/medium_walk.h"
#include "worker/render/pipeline/path_io.h"
#include "worker/render/pipeline/roulette.h"
#include "worker/render/pipeline/strategy_recorder.h"
#include "worker/render/pipeline/vertex_io.h"
#include "worker/render/pipeline/viewer_side.h"
#include "worker/render/scene/bump.h"
#include "worker/render/scene/emitter_pattern.h"
#include "worker/render/scene/fibre.h"
#include "worker/render/scene/lobe_axes.h"
#include "worker/render/scene/mix.h"

namespace lightmill {
namespace {

/// Counting sort of the active slots by BSDF kind, misses last; returns the number of hits.
template <class K>
int sort_by_kind(const RenderScene& scene, Wavefront& w) {
  Paths& p = w.paths;
  const int n = p.active_count;
  if (!K::kSurfaces || scene.kinds_present <= 1) {
    // Nothing to group; only the misses go last, in order.
    int hits = 0;
    w.sorted.clear();
    for (int i = 0; i < n; ++i) {
      const int32_t slot = p.active[i];
      if (p.rays[slot].prim >= 0) {
        p.active[hits++] = slot;
      } else {
        w.sorted.push_back(slot);
      }
    }
    std::copy(w.sorted.begin(), w.sorted.end(), p.active + hits);
    return hits;
  }
  int count[kMaterialKinds + 2] = {};
  auto key = [&](int32_t slot) {
    const int32_t prim = p.rays[slot].prim;
    return prim < 0
               ? static_cast<int32_t>(kMaterialKinds)
               : scene
                     .material_kind[static_cast<size_t>(scene.primitive_material[static_cast<size_t>(prim)])];
  };
  for (int i = 0; i < n; ++i) ++count[key(p.active[i]) + 1];
  for (int k = 0; k <= kMaterialKinds; ++k) count[k + 1] += count[k];
  const int hits = count[kMaterialKinds];
  w.sorted.resize(static_cast<size_t>(n));
  for (int i = 0; i < n; ++i) w.sorted[static_cast<size_t>(count[key(p.active[i])]++)] = p.active[i];
  std::copy(w.sorted.begin(), w.sorted.end(), p.active);
  return hits;
}

/// Where the sorted paths end: first the hits, then those in media, then those that escaped.
struct Ends {
  int hits = 0, collisions = 0;  // ends of the first two ranges
};

/// The same in a scene with media.
Ends sort_with_media(const RenderScene& scene, Wavefront& w) {
  constexpr int kCollided = kMaterialKinds, kEscaped = kMaterialKinds + 1;
  Paths& p = w.paths;
  int count[kEscaped + 2] = {};
  auto key = [&](int32_t slot) {
    const int32_t prim = p.rays[slot].prim;
    if (prim < 0) return prim == kInMedium ? kCollided : kEscaped;
    return static_cast<int>(
        scene.material_kind[static_cast<size_t>(scene.primitive_material[static_cast<size_t>(prim)])]);
  };
  for (int i = 0; i < p.active_count; ++i) ++count[key(p.active[i]) + 1];
  for (int k = 0; k <= kEscaped; ++k) count[k + 1] += count[k];
  const Ends ends{count[kCollided], count[kEscaped]};
  w.sorted.resize(static_cast<size_t>(p.active_count));
  for (int i = 0; i < p.active_count; ++i)
    w.sorted[static_cast<size_t>(count[key(p.active[i])]++)] = p.active[i];
  std::copy(w.sorted.begin(), w.sorted.end(), p.active);
  return ends;
}

template <class K>
Ends sort_paths(const RenderScene& scene, Wavefront& w) {
  if constexpr (K::kMedia) return sort_with_media(scene, w);
  const int hits = sort_by_kind<K>(scene, w);
  return {hits, hits};
}

/// A group of up to kLanes active paths; lanes past the end repeat the last one.
struct Group {
  LaneInt slot;
  LaneMask active;
  Group(const int32_t* ids, int count) {
    const LaneInt i = lane_index<Lane>();
    active = LaneMask(i < count);
    slot = gather(ids, select(active, i, splat_int<Lane>(count - 1)));
  }
};

/// A hit in lanes: the path's vertex before anything is sampled there.
struct Hit {
  PathLanes<Lane> path;
  VertexLanes<Lane> v;
  Lane distance2{}, cos_in{};  // in a medium the mean collision rate stands in for the cosine (mis.h)
  LaneMask valid;              // both normals on wo's side; on camera paths the geometric one decides
  Lane u{}, tv{};              // texture coordinates
};

/// Where the segment that ends now began; the path's ray begins at the last boundary of a medium.
Vec3<Lane> segment_start(const MediaWork& m, LaneInt slot) {
  return {gather(m.start[0], slot), gather(m.start[1], slot), gather(m.start[2], slot)};
}

template <class K>
Hit reconstruct(const RenderScene& scene, const Wavefront& w, const Group& g, Mode mode, int depth) {
  Hit h;
  h.path = load_paths<Lane>(w.paths, g.slot);
  const LaneInt prim = h.path.prim;
  const Vec3<Lane>&o = h.path.origin, &d = h.path.direction;
  const Surface<Lane> s = surface_at<Lane, K::kSurfaces>(scene, prim, h.path.instance, o, d);
  VertexLanes<Lane>& v = h.v;
  v.p = s.p;
  v.error = s.error;
  v.ng = s.ng;
  v.wo = -d;
  v.throughput = h.path.throughput;
  LaneInt material = gather(scene.primitive_material.data(), prim);
  if (K::kSurfaces && scene.any_mix) material = resolve_mixes<Lane>(scene, material, g.active, prim, s);
  v.ns = K::kSurfaces && scene.any_bumps ? bumped_normals<Lane>(scene, material, g.active, s) : s.ns;
  v.kind = bsdf_at<Lane, K::kSurfaces>(scene, material, g.active, s, &v.params);
  if (K::kSurfaces && scene.any_fibres)
    face_fibres<Lane>(scene, s, prim, v.wo, v.kind, &v.p, &v.ng, &v.ns, &v.params);
  if (K::kSurfaces && scene.any_anisotropy) orient_lobes<Lane>(s, v.ns, v.kind, &v.params);
  h.u = s.u, h.tv = s.v;
  v.path = g.slot;
  v.depth = splat_int<Lane>(depth);
  if constexpr (K::kMedia) {
    v.media = sides_met<Lane>(gather(scene.primitive_media.data(), prim), h.path.medium);
    h.path.origin = segment_start(*w.media, g.slot);
  }
  const Vec3<Lane> segment = s.p - o;
  h.distance2 = dot(segment, segment);
  const Lane cos_g = dot(s.ng, v.wo);
  h.cos_in = max(abs(cos_g), splat<Lane>(1e-12f));
  const Lane cos_s = dot(v.ns, v.wo);
  h.valid =
      mask_and(g.active, LaneMask(cos_g * (mode == Mode::kRadiance ? copysign(cos_s, cos_g) : cos_s) > 0.0f));
  v.dvcm = h.path.dvcm;
  v.dvc = h.path.dvc;
  return h;
}

/// The vertex of paths that ended in a medium. Both normals are wo, the axis of the phase function.
Hit collision(const RenderScene& scene, const Wavefront& w, const Group& g, int depth) {
  Hit h;
  const MediaWork& m = *w.media;
  h.path = load_paths<Lane>(w.paths, g.slot);
  h.path.origin = segment_start(m, g.slot);
  const MediumRecord<Lane> medium(scene.media.data(), h.path.medium);
  VertexLanes<Lane>& v = h.v;
  v.p = {gather(m.end[0], g.slot), gather(m.end[1], g.slot), gather(m.end[2], g.slot)};
  v.wo = v.ng = v.ns = -h.path.direction;
  v.throughput = h.path.throughput;
  v.kind = splat_int<Lane>(kPhaseFunction);
  v.params.p[0] = medium.scalar(kMediumG);
  v.params.tables = scene.bsdf_tables.data();
  v.media = h.path.medium | (h.path.medium << kMediumBits);
  v.path = g.slot;
  v.depth = splat_int<Lane>(depth);
  const Vec3<Lane> segment = v.p - h.path.origin;
  h.distance2 = dot(segment, segment);
  h.cos_in = medium.scalar(kMediumMeanRate);
  h.valid = mask_and(g.active, LaneMask(max_component(v.throughput) > 0.0f));
  v.dvcm = h.path.dvcm;
  v.dvc = h.path.dvc;
  return h;
}

/// Samples the BSDF, updates throughput and MIS terms (M4, M5), plays roulette, writes the next ray. Returns
/// the lanes that go on.
template <class K>
LaneMask scatter_paths(const StageContext& context, const SampleStream<Lane>& stream, const Hit& h,
                       LaneMask active, Mode mode, int depth, bool keep_dvc, Wavefront& w) {
  const VertexLanes<Lane>& v = h.v;
  const Frame<Lane> frame(v.ns);
  Vec3<Lane> wo = frame.to_local(v.wo);
  const bool tilted_normals = context.scene.any_shading_normals();
  if (tilted_normals && mode == Mode::kRadiance) wo = viewer_direction(wo, dot(v.ng, v.wo));
  Lane du, dv;
  stream.get_2d(vertex_dim(depth, kDimBsdfDirection), &du, &dv);
  // One lobe needs no choice.
  const bool lobes = K::kSurfaces && any(mask_not(LaneMask(v.kind == kDiffuse)));
  const Lane lobe_u = lobes ? stream.get_1d(vertex_dim(depth, kDimBsdfLobe)) : Lane{};
  const BsdfSample<Lane> s =
      sample_bsdf<Lane, K::kSurfaces>(v.kind, active, v.params, wo, lobe_u, du, dv, mode);
  Vec3<Lane> wi = frame.to_world(s.wi);
  // The direction must lie on the side of both normals that the BSDF meant.
  Lane cos_g = dot(v.ng, wi);
  LaneMask same_side = LaneMask(cos_g * s.wi.z > 0.0f);
  LaneMask in_medium = splat_mask<Lane>(false);
  if constexpr (K::kMedia) {
    in_medium = LaneMask(v.kind == kPhaseFunction);
    same_side = mask_or(same_side, in_medium);
  }
  LaneMask go = mask_and(mask_and(active, s.valid), same_side);
  Vec3<Lane> weight = s.weight;
  Lane pdf = s.pdf, pdf_reverse = s.pdf_reverse, delta_ratio = splat<Lane>(1.0f);
  if (tilted_normals && mode == Mode::kRadiance) {
    delta_ratio = viewer_density(v, v.wo);
    pdf_reverse = pdf_reverse * delta_ratio;
  } else if (tilted_normals) {
    // The direction or its mirror image (viewer_side.h).
    const Lane tilt = dot(v.ns, v.ng);
    const LaneMask two = has_mirror_image(s.wi.z, cos_g, tilt);
    const LaneMask mirror = mask_and(two, LaneMask(stream.get_1d(vertex_dim(depth, kDimViewerSide)) < 0.5f));
    wi = select(mirror, wi - v.ns * (2.0f * s.wi.z), wi);
    cos_g = select(mirror, cos_g - 2.0f * s.wi.z * tilt, cos_g);
    delta_ratio = select(two, splat<Lane>(2.0f), splat<Lane>(1.0f));
    weight = weight * delta_ratio;
    pdf = select(s.delta, pdf, pdf * select(two, splat<Lane>(0.5f), splat<Lane>(1.0f)));
    // Adjoint of shading normals (Veach 1997, eq. 5.19): |wo.ns| |wi.ng| / (|wo.ng| |wi.ns|).
    const Lane correction = abs(wo.z) * abs(cos_g) / (h.cos_in * max(abs(s.wi.z), splat<Lane>(1e-12f)));
    const LaneMask tilted =
        mask_or(mask_or(LaneMask(v.ns.x != v.ng.x), LaneMask(v.ns.y != v.ng.y)), LaneMask(v.ns.z != v.ng.z));
    weight = select(tilted, weight * correction, weight);
  }
  Vec3<Lane> throughput = v.throughput * weight;
  const Lane before = K::kMedia ? gather(w.media->before, v.path) : max_component(v.throughput),
             after = max_component(throughput) * s.roulette_scale;
  go = mask_and(go, LaneMask(after > 0.0f));
  if (depth > kRouletteStart) {
    // Survival is the loss of throughput at this event, so that the product over a path tracks
    // its throughput.
    const Lane q = min(after / before, splat<Lane>(roulette_cap(depth)));
    const Lane u = stream.get_1d(vertex_dim(depth, kDimRoulette));
    go = mask_and(go, LaneMask(u < q));
    throughput = throughput * (1.0f / select(LaneMask(q > 0.0f), q, splat<Lane>(1.0f)));
  }
  if (!any(go)) return go;
  const Lane cos_out = K::kMedia ? select(in_medium, h.cos_in, abs(cos_g)) : abs(cos_g);
  const Lane inv_pdf = 1.0f / pdf;
  const Lane dvc = select(s.delta, v.dvc * (cos_out * delta_ratio),
                          cos_out * inv_pdf * (v.dvc * pdf_reverse + v.dvcm));  // M4, M5
  const Lane dvcm = select(s.delta, Lane{}, inv_pdf);
  if (StrategyRecorder* recorder = recorder_of<K>(w)) {
    const Lane gain = select(s.delta, cos_out * delta_ratio, cos_out * inv_pdf * pdf_reverse);
    const Lane own = select(s.delta, Lane{}, cos_out * inv_pdf * v.dvcm);
    recorder->scatter(mode == Mode::kImportance, depth, v.path, go, gain, own);
  }
  PathLanes<Lane> next{offset_origin(v.p, v.error, v.ng, wi), wi, throughput, dvcm};
  if (keep_dvc) next.dvc = dvc;
  if constexpr (K::kMedia) next.medium = medium_on_side<Lane>(v.media, LaneMask(cos_g > 0.0f));
  store_paths(next, v.path, mask_bits(go), &w.paths);
  return go;
}

/// Those that have a lobe which is not a delta.
template <class K>
LaneMask connectable_lanes(const Hit& h) {
  return K::kSurfaces ? mask_and(h.valid, mask_not(pure_delta<Lane>(h.v.kind))) : h.valid;
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

void add_radiance(Wavefront& w, LaneInt slot, LaneMask m, const Vec3<Lane>& c) {
  for (unsigned bits = mask_bits(m); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const auto i = static_cast<size_t>(lane(slot, l));
    w.radiance_r[i] += lane(c.x, l);
    w.radiance_g[i] += lane(c.y, l);
    w.radiance_b[i] += lane(c.z, l);
  }
}

/// `w_other` is the ratio of next event, at depth 1 that of the lens connection.
void record_emission(int depth, LaneInt slot, LaneMask mask, const Vec3<Lane>& c, Lane mis, Lane w_other,
                     Lane p_emission, Lane dvc, Wavefront& w) {
  FamilyRatios ratios{};
  add_ratio(&ratios, &FamilyShares::hit, splat<Lane>(1.0f));
  add_ratio(&ratios, depth == 1 ? &FamilyShares::lens : &FamilyShares::next_event, w_other);
  w.recorder->add_camera_path(slot, p_emission, dvc, &ratios);
  w.recorder->emission(depth + 1, slot, mask, c, mis, ratios);
}

/// Camera paths that left the scene see the infinite lights (M6).
template <class K>
void add_environment(const StageContext& context, const Group& g, int depth, bool weigh_connections,
                     Wavefront& w) {
  const LightTable& lights = context.scene.lights;
  const PathLanes<Lane> path = load_paths<Lane>(w.paths, g.slot);
  const Vec3<Lane>&throughput = path.throughput, &wi = path.direction;
  const Lane dvcm = path.dvcm, dvc = path.dvc;
  for (int32_t index : lights.infinite) {
    const LaneInt light = splat_int<Lane>(index);
    const LightRecord<Lane> r(lights, light);
    const LaneMask all = splat_mask<Lane>(true);
    Lane w_next_event{}, p_emission{};
    if (depth > 1) {
      if (context.on(kNextEvent)) {
        w_next_event =
            direct_pdf_area<Lane>(lights, light, path.origin, wi, splat<Lane>(1.0f), splat<Lane>(1.0f)) *
            dvcm;
      }
      if (weigh_connections) p_emission = emission_pdf(lights, light, path.origin, wi, splat<Lane>(1.0f));
    }
    const Lane w_camera = weigh_connections ? w_next_event + p_emission * dvc : w_next_event;
    const Lane mis = mis_weight(Lane{}, w_camera);
    const LaneMask seen = mask_and(g.active, through_portals(lights, light, path.origin, wi));
    const Vec3<Lane> c = throughput * infinite_radiance(lights, r, all, wi) * (mis * context.imaging_ratio);
    add_radiance(w, g.slot, seen, c);
    if (recorder_of<K>(w)) record_emission(depth, g.slot, seen, c, mis, w_next_event, p_emission, dvc, w);
  }
}

/// Camera paths that hit an emitter (s = 0, M6).
template <class K>
void add_emission(const StageContext& context, const Hit& h, LaneMask active, int depth,
                  bool weigh_connections, Wavefront& w) {
  const RenderScene& scene = context.scene;
  const LaneInt index = gather(scene.primitive_light.data(), h.path.prim);
  const LaneMask emits = mask_and(active, LaneMask(index >= 0));
  if (!any(emits)) return;
  const LaneInt light = select(emits, index, LaneInt{});
  const LightTable& lights = scene.lights;
  Vec3<Lane> radiance = emitted_radiance(lights, light, h.v.ng, h.v.wo);
  if (K::kLights && !lights.patterns.empty())
    radiance = radiance * hit_pattern(scene, light, emits, h.u, h.tv, h.v.p);
  Lane w_other{}, p_emission{};
  if (depth > 1) {
    if (context.on(kNextEvent)) {
      w_other = direct_pdf_area<Lane, K::kLights>(lights, light, h.path.origin, -h.v.wo, h.distance2,
                                                  h.cos_in, emits) *
                h.v.dvcm;
    }
    if (weigh_connections) p_emission = emission_pdf<Lane, K::kLights>(lights, light, h.v.p, -h.v.wo, h.cos_in);
  } else if (context.on(kLensConnections)) {
    const LightRecord<Lane> r(lights, light);
    w_other = r.scalar(kLightSelect) / r.scalar(kLightArea) * h.v.dvcm;  // M10
  }
  const Lane mis = mis_weight(Lane{}, weigh_connections ? w_other + p_emission * h.v.dvc : w_other);
  const Vec3<Lane> c = h.v.throughput * radiance * (mis * context.imaging_ratio);
  const LaneMask shines = mask_and(emits, LaneMask(max_component(radiance) > 0.0f));
  add_radiance(w, h.v.path, shines, c);
  if (recorder_of<K>(w)) record_emission(depth, h.v.path, shines, c, mis, w_other, p_emission, h.v.dvc, w);
}

/// Calls meet(group, hit) for all paths that have a vertex, eight at a time.
template <class K, class Meet>
void for_each_vertex(const RenderScene& scene, const Ends& ends, Mode mode, int depth, Wavefront& w,
                     Meet&& meet) {
  // Survivors are compacted into the active list while it is read, whole vectors at a time: they would run
  // over the end of a range that is not the last. sort_with_media leaves a copy.
  const int32_t* slots = K::kMedia ? w.sorted.data() : w.paths.active;
  for (int base = 0; base < ends.hits; base += kLanes) {
    const Group g(slots + base, std::min(kLanes, ends.hits - base));
    Hit h = reconstruct<K>(scene, w, g, mode, depth);
    meet(g, h);
  }
  if constexpr (K::kMedia) {
    for (int base = ends.hits; base < ends.collisions; base += kLanes) {
      const Group g(slots + base, std::min(kLanes, ends.collisions - base));
      Hit h = collision(scene, w, g, depth);
      meet(g, h);
    }
  }
}

template <class K>
void light_vertices(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  const RenderScene& scene = context.scene;
  Paths& paths = w.paths;
  const Ends ends = sort_paths<K>(scene, w);
  // A vertex at `depth` is the depth-th scattering event of a path through the lens.
  const bool go_on = depth < context.max_depth && (context.lens_alone() || depth < kMaxLightVertices);
  int survivors = 0;
  for_each_vertex<K>(scene, ends, Mode::kImportance, depth, w, [&](const Group& g, Hit& h) {
    if (recorder_of<K>(w)) record_vertex(h, g, true, depth, w);
    // M3; the first segment also receives p_direct of M1.
    if (depth == 1) {
      const LaneInt light = h.path.light;
      const Lane cos_light = h.path.cos_light;
      h.v.dvcm = h.v.dvcm * direct_pdf_area<Lane, K::kLights>(scene.lights, light, h.v.p, h.v.wo, h.distance2,
                                                              cos_light, g.active);
      LaneMask finite = splat_mask<Lane>(true);
      if (K::kLights && scene.lights.any_infinite()) {
        const LaneInt type = gather(scene.lights.type.data(), light);
        finite = mask_and(LaneMask(type != kInfiniteLight), LaneMask(type != kDistantLight));
      }
      h.v.dvcm = h.v.dvcm * select(finite, h.distance2, splat<Lane>(1.0f));
      // What is met before the portal does not see the light through it.
      h.valid = mask_and(h.valid, through_portals<Lane, K::kLights>(scene.lights, light, h.v.p, h.v.wo));
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
    if (StrategyRecorder* recorder = recorder_of<K>(w)) {
      recorder->hit(true, g.slot, g.active, inv_cos);
      recorder->store(true, w.light_vertices.size(), g.slot, connectable);
    }
    append_vertices(h.v, mask_bits(connectable), &w.light_vertices);
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
  if (K::kLights && context.on(kEmissionHits) && !scene.lights.infinite.empty()) {
    for (int base = ends.collisions; base < paths.active_count; base += kLanes) {
      add_environment<K>(context, Group(paths.active + base, std::min(kLanes, paths.active_count - base)),
                         depth, weigh_connections, w);
    }
  }
  int survivors = 0;
  for_each_vertex<K>(scene, ends, Mode::kRadiance, depth, w, [&](const Group& g, Hit& h) {
    const bool in_medium = K::kMedia && lane(h.v.kind, 0) == kPhaseFunction;
    if (recorder_of<K>(w)) record_vertex(h, g, false, depth, w);
    if (K::kObserved && w.aovs && !in_medium) w.aovs->hits(context, h.v, g.active, depth);
    if (K::kObserved && w.aovs && in_medium) w.aovs->ends_in_medium(g.slot, g.active);
    const Lane inv_cos = 1.0f / h.cos_in;
    // M3; rays of a parallel camera spread no more with distance.
    h.v.dvcm = h.v.dvcm * (parallel ? splat<Lane>(1.0f) : h.distance2) * inv_cos;
    h.v.dvc = h.v.dvc * inv_cos;
    if (StrategyRecorder* recorder = recorder_of<K>(w)) recorder->hit(false, g.slot, g.active, inv_cos);
    if (context.on(kEmissionHits) && !in_medium)
      add_emission<K>(context, h, g.active, depth, weigh_connections, w);
    // From here on dVCM stands for one strategy: joining the vertex before. M2 brought the lens' n_j.
    h.v.dvcm = h.v.dvcm * (depth > 1                      ? context.samples_of(kVertexConnections)
                           : context.on(kLensConnections) ? 1.0f
                                                          : 0.0f);
    if (depth > context.max_depth) return;
    const LaneMask connectable = connectable_lanes<K>(h);
    if (StrategyRecorder* recorder = recorder_of<K>(w))
      recorder->store(false, w.vertices.size(), g.slot, connectable);
    append_vertices(h.v, mask_bits(connectable), &w.vertices);
    const LaneMask go = scatter_paths<K>(context, layer.camera_stream<Lane>(g.slot), h, h.valid,
                                         Mode::kRadiance, depth, context.on(kLightPaths), w);
    append_survivors(g.slot, go, paths.active, &survivors);
  });
  paths.active_count = survivors;
}

}  // namespace

void bounce_light_paths(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  with_kernels(context, w, [&]<class K>(K) { light_vertices<K>(context, layer, depth, w); });
}

void bounce_camera_paths(const StageContext& context, const LayerContext& layer, int depth, Wavefront& w) {
  with_kernels(context, w, [&]<class K>(K) { camera_vertices<K>(context, layer, depth, w); });
}

}  // namespace lightmill
