#pragma once
// Grids that shine, as lights that next-event estimation finds.
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Adds a light for each grid of scene->volumes that shines, and the media around them to lights.media. A
/// brick is weighed by the light that leaves it: its emission, less what the brick itself absorbs. `scene`
/// has its media. `threads` 0: one per processor.
void add_volume_lights(int threads, RenderScene* scene);

}  // namespace lightmill
