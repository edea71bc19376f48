#pragma once
// What a job's layers take, in memory and on the wire.
#include "common/job/settings.h"

namespace lightmill {

/// Most bytes that the film, the batches of the error estimate and the reference image of such a job come to,
/// whatever is folded into them.
double film_bytes(const RenderSettings& settings);

/// About the bytes that the splats of a tile take in its encoded partial, once the tile has a few samples for
/// every pixel of the crop window: however small its rectangle is. 0 if the job has no splats.
double splat_layer_bytes(const RenderSettings& settings);

}  // namespace lightmill
