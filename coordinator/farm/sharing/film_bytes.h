#pragma once
// The size of a job's layers, in memory and on the wire.
#include "common/job/settings.h"

namespace lightmill {

/// Most bytes of the film, the batches of the error estimate and the reference image of such a job, whatever
/// is folded into them.
double film_bytes(const RenderSettings& settings);

/// About the bytes of a tile's splats in its encoded partial, once the tile has a few samples for every pixel
/// of the crop window. They do not depend on the size of the tile's rectangle. 0 if the job has no splats.
double splat_layer_bytes(const RenderSettings& settings);

}  // namespace lightmill
