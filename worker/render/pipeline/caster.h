#pragma once
// Stage 2: closest hits for the whole wavefront.
#include "worker/render/pipeline/context.h"

namespace lightmill {

inline void cast_paths(const StageContext& context, Wavefront& wavefront) {
  Paths& p = wavefront.paths;
  context.accel.closest_hits({p.ox, p.oy, p.oz, p.dx, p.dy, p.dz}, p.active, p.active_count, p.prim,
                             context.scene.any_instances() ? p.instance : nullptr);
  wavefront.counters.closest_hit_rays += static_cast<uint64_t>(p.active_count);
}

}  // namespace lightmill
