#pragma once
// Lamps that camera paths go through (s = 0 in mis.h; light/lamp.h). A path counts all of them on its way,
// and goes on. Scenes with media have none that are counted: their light at a lamp would be that of a part
// of the segment.
#include "worker/render/pipeline/connections/emitter_hits.h"

namespace lightmill {

/// Adds the lamps between the origins of `path` and `end` (distances) to camera paths (M6). `path`: as it was
/// before its vertex at `depth`.
template <class K>
void add_lamps(const StageContext& context, const Group& g, const PathLanes<Lane>& path, Lane end, int depth,
               bool weigh_connections, Wavefront& w) {
  const LightTable& lights = context.lights;
  const Lane time = light_times<K>(lights, w.paths, g.slot);
  for (const int32_t index : lights.lamps) {
    const LaneInt light = splat_int<Lane>(index);
    const LightType type = lights.type[static_cast<size_t>(index)];
    LightRecord<Lane> r(lights, light);
    r.move_to(lights, light, time);
    const LampHit<Lane> hit = meet_lamp(r, type, path.origin, path.direction);
    LaneMask met = mask_and(mask_and(g.active, hit.met), LaneMask(hit.distance < end));
    if (!any(met)) continue;
    met = seen_lights(lights, light, met, [&](int l) { return w.paths.kinds[lane(g.slot, l)]; });
    Lane w_next_event{}, p_emission{};
    if (depth > 1) {
      // M3 for the lamp: lines of facing lamps have their densities at the other end.
      const bool facing = type == kFacingLamp;
      const Lane distance2 = hit.distance * hit.distance;
      const Lane per_angle = facing ? splat<Lane>(1.0f) : distance2 / hit.cos_light;
      if (context.on(kNextEvent)) {
        w_next_event = direct_pdf_area<Lane>(lights, light, path.origin, path.direction, distance2,
                                             hit.cos_light, met, time) *
                       per_angle * path.dvcm;
      }
      if (weigh_connections) {
        p_emission = emission_pdf(lights, light, path.origin + path.direction * hit.distance, path.direction,
                                  hit.cos_light, time) /
                     hit.cos_light;
      }
    }
    const Lane w_camera = weigh_connections ? w_next_event + p_emission * path.dvc : w_next_event;
    const Lane mis = mis_weight(Lane{}, w_camera);
    LaneMask shines = mask_and(met, LaneMask(max_component(hit.radiance) > 0.0f));
    if (K::kSurfaces && w.manifolds) {
      const LaneMask counted =
          counted_by_manifolds(context, g.slot, shines, light, path.origin + path.direction * hit.distance,
                               splat_mask<Lane>(false), depth, w);
      shines = mask_and(shines, mask_not(counted));
    }
    const Vec3<Lane> c = path.throughput * hit.radiance * (mis * context.imaging_ratio);
    add_radiance(w, g.slot, shines, c, groups_of(w, lights, light),
                 lobes_of_hit(lobes_of<K>(w), g.slot, depth));
    if (recorder_of<K>(w))
      record_emission(depth, g.slot, shines, c, mis, w_next_event, p_emission, path.dvc, w);
  }
}

}  // namespace lightmill
