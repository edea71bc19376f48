#pragma once
// Emitter hits in stage 3: camera paths that end on an emitter or escape to an infinite light (s = 0 in
// mis.h).
#include "worker/render/light/light_sampling.h"
#include "worker/render/pipeline/connections/manifold_next_event.h"
#include "worker/render/pipeline/paths/first_event.h"
#include "worker/render/pipeline/paths/path_kinds.h"
#include "worker/render/pipeline/paths/path_radiance.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/paths/path_vertex.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/scene/lights/emitter_pattern.h"

namespace lightmill {

/// `w_other`: the ratio of next-event estimation, at depth 1 that of light tracing.
inline void record_emission(int depth, LaneInt slot, LaneMask mask, const Vec3<Lane>& c, Lane mis,
                            Lane w_other, Lane p_emission, Lane dvc, Wavefront& w) {
  FamilyRatios ratios{};
  add_ratio(&ratios, &FamilyShares::hit, splat<Lane>(1.0f));
  add_ratio(&ratios, depth == 1 ? &FamilyShares::lens : &FamilyShares::next_event, w_other);
  w.recorder->add_camera_path(slot, p_emission, dvc, &ratios);
  w.recorder->emission(depth + 1, slot, mask, c, mis, ratios);
}

/// Adds the infinite lights to camera paths that left the scene (M6).
template <class K>
void add_environment(const StageContext& context, const Group& g, int depth, bool weigh_connections,
                     Wavefront& w) {
  const LightTable& lights = context.lights;
  const PathLanes<Lane> path = load_paths<Lane>(w.paths, g.slot);
  const Vec3<Lane>&throughput = path.throughput, &wi = path.direction;
  Vec3<Lane> from = path.origin;
  if constexpr (K::kMedia) from = segment_start(*w.media, g.slot);
  const Lane dvcm = path.dvcm, dvc = path.dvc;
  for (int32_t index : lights.infinite) {
    const LaneInt light = splat_int<Lane>(index);
    const LightRecord<Lane> r(lights, light);
    const LaneMask all = splat_mask<Lane>(true);
    Lane w_next_event{}, p_emission{};
    if (depth > 1) {
      if (context.on(kNextEvent)) {
        w_next_event =
            direct_pdf_area<Lane>(lights, light, from, wi, splat<Lane>(1.0f), splat<Lane>(1.0f)) * dvcm;
      }
      if (weigh_connections) p_emission = emission_pdf(lights, light, from, wi, splat<Lane>(1.0f));
    }
    const Lane w_camera = weigh_connections ? w_next_event + p_emission * dvc : w_next_event;
    const Lane mis = mis_weight(Lane{}, w_camera);
    LaneMask seen = mask_and(g.active, through_portals(lights, light, from, wi));
    seen = seen_lights(lights, light, seen, [&](int l) { return w.paths.kinds[lane(g.slot, l)]; });
    if (K::kSurfaces && w.manifolds) {
      const LaneMask counted = counted_by_manifolds(context, g.slot, seen, light, wi, all, depth, w);
      seen = mask_and(seen, mask_not(counted));
    }
    const Vec3<Lane> c = throughput * infinite_radiance(lights, r, all, wi) * (mis * context.imaging_ratio);
    add_radiance(w, g.slot, seen, c, groups_of(w, lights, light),
                 lobes_of_hit(lobes_of<K>(w), g.slot, depth));
    if (recorder_of<K>(w)) record_emission(depth, g.slot, seen, c, mis, w_next_event, p_emission, dvc, w);
  }
}

/// Adds the emitters that camera paths hit (s = 0, M6).
template <class K>
void add_emission(const StageContext& context, const Hit& h, LaneMask active, int depth,
                  bool weigh_connections, Wavefront& w) {
  const RenderScene& scene = context.scene;
  const LaneInt index = gather(scene.primitive_light.data(), h.path.prim);
  const LaneMask emits = mask_and(active, LaneMask(index >= 0));
  if (!any(emits)) return;
  const LaneInt light = select(emits, index, LaneInt{});
  const LightTable& lights = context.lights;
  Vec3<Lane> radiance = emitted_radiance(lights, light, h.v.ng, h.v.wo);
  if (K::kLights && !lights.patterns.empty())
    radiance = radiance * hit_pattern(scene, light, emits, h.u, h.tv, h.v.p);
  const Lane time = light_times<K>(lights, w.paths, h.v.path);
  Lane w_other{}, p_emission{};
  if (depth > 1) {
    if (context.on(kNextEvent)) {
      w_other = direct_pdf_area<Lane, K::kLights>(lights, light, h.path.origin, -h.v.wo, h.distance2,
                                                  h.cos_in, emits, time) *
                h.v.dvcm;
    }
    if (weigh_connections)
      p_emission = emission_pdf<Lane, K::kLights>(lights, light, h.v.p, -h.v.wo, h.cos_in, time);
  } else if (context.on(kLightTracing)) {
    LightRecord<Lane> r(lights, light);
    if constexpr (K::kLights) r.move_to(lights, light, time);
    w_other = r.scalar(kLightSelect) / r.scalar(kLightArea) * h.v.dvcm;  // M10
  }
  const Lane mis = mis_weight(Lane{}, weigh_connections ? w_other + p_emission * h.v.dvc : w_other);
  const Vec3<Lane> c = h.path.throughput * radiance * (mis * context.imaging_ratio);
  LaneMask shines = mask_and(emits, LaneMask(max_component(radiance) > 0.0f));
  if (K::kSurfaces && w.manifolds) {
    const LaneMask counted =
        counted_by_manifolds(context, h.v.path, shines, light, h.v.p, splat_mask<Lane>(false), depth, w);
    shines = mask_and(shines, mask_not(counted));
  }
  add_radiance(w, h.v.path, shines, c, groups_of(w, lights, light),
               lobes_of_hit(lobes_of<K>(w), h.v.path, depth));
  if (recorder_of<K>(w)) record_emission(depth, h.v.path, shines, c, mis, w_other, p_emission, h.v.dvc, w);
}

}  // namespace lightmill
