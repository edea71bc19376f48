#pragma once
// Light for files that bring next to none: what viewers of glTF do, so that there is something to see.
#include "common/scene/gltf/scene.h"

namespace lightmill {

/// Adds a grey sky and a lamp, with a warning, unless the scene has lights or emits enough to be seen by. A
/// texture of emission of a strength of at most 1 is decoration, as on most models, and counts for nothing;
/// what is unlit needs no light.
void light_up_if_dark(GltfScene& out);

}  // namespace lightmill
