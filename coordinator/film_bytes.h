#pragma once
// What a job's merged layers take in memory.
#include "common/settings.h"

namespace lightmill {

/// Most bytes that the film, the batches of the error estimate and the reference image of such a job come to,
/// whatever is folded into them.
double film_bytes(const RenderSettings& settings);

}  // namespace lightmill
