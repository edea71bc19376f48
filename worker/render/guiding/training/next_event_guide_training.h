#pragma once
// Learns what gets from the lights to where camera paths go, and makes the light guide of it
// (guiding/next_event_guide.h).
//
// A few camera paths are followed over the whole film, and from their vertices rays are cast to lights and
// into the bins of the sky. The mean square of what comes back is kept for every cell of a grid and for ever
// coarser cells; a cell that few rays stand for leans on the coarser one around it.
//
// Only where there is light at infinity. For lamps alone a guide was tried: it halves the mean square of the
// light samples of kitchen, coffee and veach-bidir, but brings 4 to 10 % of relMSE x CPU time of `auto` at 64
// spp, seemed to lose 16 % on veach-mis, and takes 0.15 to 0.35 s at the start.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Gives scene->lights a guide, or leaves them as they are without light at infinity, where a guide would
/// gain little, and in media. On `threads` threads, of which no bit depends. A function of the scene and the
/// film's resolution alone.
void learn_lights(const Accel& accel, const Camera& camera, const PixelFilter& filter, int width, int height,
                  int threads, RenderScene* scene);

}  // namespace lightmill
