#pragma once
// Stage 2: closest hits for the whole wavefront.
#include <memory>

#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/paths/path_kinds.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/recording/stage_probe.h"
#include "worker/render/pipeline/walks/medium_walk.h"

namespace lightmill {

inline void cast_paths(const StageContext& context, Wavefront& wavefront, KindsOfRays kinds = {}) {
  Paths& p = wavefront.paths;
  if (wavefront.probe) wavefront.probe->cast(p);
  const StageScope scope(wavefront, Stage::kCast);
  context.accel.closest_hits(p.rays, p.active, p.active_count, times_of_rays(context.scene, p), kinds);
  wavefront.counters.closest_hit_rays += static_cast<uint64_t>(p.active_count);
}

/// Makes a wavefront ready for its first packet of the scene.
inline void prepare(const StageContext& context, Wavefront* w) {
  if (context.scene.any_media() && !w->media) w->media = std::make_shared<MediaWork>();
}

/// Casts rays, through media if the scene has them. `depth`: of the vertices to come.
inline void cast_light_paths(const StageContext& context, const LayerContext& layer, int depth,
                             Wavefront& w) {
  w.media ? cast_light_paths_through_media(context, layer, depth, w) : cast_paths(context, w);
}
inline void cast_camera_paths(const StageContext& context, const LayerContext& layer, int depth,
                              Wavefront& w) {
  w.media ? cast_camera_paths_through_media(context, layer, depth, w)
          : cast_paths(context, w, kinds_of_camera_rays(context.scene, w.paths));
}

}  // namespace lightmill
