#pragma once
// Cuts the grids of media into bricks.
#include "common/scene/description.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Adds the medium's grid to scene->volumes and returns its number. `scene` has its space and the medium's
/// record: `medium` of RenderScene::media. `way`: of a grid that moves, where it is at even times, from where
/// it is at first, else empty. `collides`: paths may end a segment in it. Clouds are made by `threads` (0:
/// one per processor). Throws Error(kBadScene) if float can't hold its extinction at the scene's scale, or
/// there is more of it than can be addressed.
int32_t add_grid(const MediumDescription& description, const std::vector<Transform>& way, const float* medium,
                 bool collides, int threads, RenderScene* scene);

}  // namespace lightmill
