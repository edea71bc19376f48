#pragma once
// The brightness that the lights of a scene are brought to: one that floats have room around.
//
// Samplers, guides and the pilot square and divide what lights bring. So lights of 1e30, or of 1e-30, which
// floats hold, would not be held there. RenderScene has all light divided by a power of two; what leaves the
// pipeline, sums and splats, is multiplied by it. That changes no bit.
#include "common/scene/description.h"

namespace lightmill {

/// The exponent of that power: 0 where lights are between 2^-40 and 2^40, or where the film has a limit of
/// its own. Lengths are multiplied by 2^scale_exponent, and so are intensities by its square. Of images only
/// what multiplies them is known.
int light_exponent(const SceneDescription& scene, int scale_exponent);

}  // namespace lightmill
