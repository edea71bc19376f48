#pragma once
// Brings the lights of a scene to a brightness that floats have room around.
//
// Samplers, guides and the pilot square and divide what lights bring. So lights of 1e30, or of 1e-30, which
// floats hold, would not be held there. All light is multiplied by a power of two; what leaves the pipeline,
// sums and splats, by its inverse. That changes no bit.
#include "common/scene/description.h"

namespace lightmill {

/// Divides all light of `scene` by 2^k and returns k; 0 where lights are between 2^-40 and 2^40, or where the
/// film has a limit of its own. Of images only what multiplies them is known.
int normalise_light(SceneDescription* scene);

}  // namespace lightmill
