#pragma once
// Trains the next-event guide (guiding/next_event_guide.h): what arrives from the lights where camera paths
// go.
//
// A few camera paths are followed over the whole film. From their vertices rays are cast to lights and into
// the bins of the sky. The mean square of what comes back is kept for every cell of a grid and for ever
// coarser cells. A cell with few rays leans on the coarser one around it.
//
// Only where there is light at infinity, or where lamps differ so much in power (kUnequal) that one of them,
// hidden, would take nearly all samples. For other lamps a guide was tried: it halves the mean square of the
// light samples of kitchen, coffee and veach-bidir, but brings 4 to 10 % of relMSE x CPU time of `auto` at 64
// spp, seemed to lose 16 % on veach-mis, and takes 0.15 to 0.35 s at the start.
#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Gives scene->lights a guide. Leaves them as they are where a guide would gain little, and where media
/// shine. A function of the scene and the film's resolution alone; the same for any number of `threads`.
void train_next_event_guide(const Accel& accel, const Camera& camera, const PixelFilter& filter, int width,
                            int height, int threads, RenderScene* scene);

}  // namespace lightmill
