#pragma once
// Stage 2: closest hits for the whole wavefront.
#include <memory>

#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/paths/path_kinds.h"
#include "worker/render/pipeline/paths/path_times.h"
#include "worker/render/pipeline/recording/stage_probe.h"
#include "worker/render/pipeline/walks/alpha_walk.h"
#include "worker/render/pipeline/walks/medium_walk.h"

namespace lightmill {

inline void cast_paths(const StageContext& context, Wavefront& wavefront, KindsOfRays kinds = {}) {
  Paths& p = wavefront.paths;
  if (wavefront.probe) wavefront.probe->cast(p);
  const StageScope scope(wavefront, Stage::kCast);
  context.accel.closest_hits(p.rays, p.active, p.active_count, times_of_rays(context.scene, p), kinds);
  wavefront.counters.closest_hit_rays += static_cast<uint64_t>(p.active_count);
}
inline void cast_paths(const StageContext& context, const LayerContext& layer, bool light, int depth,
                       Wavefront& w, KindsOfRays kinds = {}) {
  if (!w.alphas) return cast_paths(context, w, kinds);
  if (w.probe) w.probe->cast(w.paths);
  const StageScope scope(w, Stage::kCast);
  cast_through_alpha(context, layer, light, depth, kinds, w);
}

/// Makes a wavefront ready for its first packet of the scene.
inline void prepare(const StageContext& context, Wavefront* w) {
  if (context.scene.any_media()) {
    if (!w->media) w->media = std::make_shared<MediaWork>();
  } else if (context.scene.any_alpha && !w->alphas) {
    w->alphas = std::make_shared<AlphaWork>();
    w->alphas->passed.of.resize(kWavefront);
  }
}

/// Casts rays, through media and what stops a part of them if the scene has such. `depth`: of the vertices to
/// come.
inline void cast_light_paths(const StageContext& context, const LayerContext& layer, int depth,
                             Wavefront& w) {
  w.media ? cast_light_paths_through_media(context, layer, depth, w)
          : cast_paths(context, layer, true, depth, w);
}
inline void cast_camera_paths(const StageContext& context, const LayerContext& layer, int depth,
                              Wavefront& w) {
  w.media ? cast_camera_paths_through_media(context, layer, depth, w)
          : cast_paths(context, layer, false, depth, w, kinds_of_camera_rays(context.scene, w.paths));
}

}  // namespace lightmill
