#pragma once
// Warns of textures whose values do not fit their use. Rendering clamps values that no surface can have,
// texel by texel. This says once that it will.
#include <vector>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// A warning for every texture that may leave the range of an input that it feeds (reflectances and roughness
/// outside of [0, 1], normal maps without direction), or that holds texels which are not finite. Ranges are
/// bounds: those of a texture made of others follow by interval arithmetic.
std::vector<Problem> check_textures(const SceneDescription& description, const TextureTable& textures);

}  // namespace lightmill
