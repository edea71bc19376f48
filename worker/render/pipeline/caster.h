#pragma once
// Stage 2: closest hits for the whole wavefront.
#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/path_times.h"
#include "worker/render/pipeline/stage_probe.h"

namespace lightmill {

inline void cast_paths(const StageContext& context, Wavefront& wavefront) {
  Paths& p = wavefront.paths;
  if (wavefront.probe) wavefront.probe->cast(p);
  const StageScope scope(wavefront, Stage::kCast);
  context.accel.closest_hits(p.rays, p.active, p.active_count, times_of_rays(context.scene, p));
  wavefront.counters.closest_hit_rays += static_cast<uint64_t>(p.active_count);
}

}  // namespace lightmill
