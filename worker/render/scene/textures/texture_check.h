#pragma once
// What textures hold against what is done with them: values that no surface can have are clamped while
// rendering, texel by texel; here is said once that they will be.
#include <vector>

#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// A warning for every texture that may leave the range of an input that it feeds (reflectances and roughness
/// outside of [0, 1], normal maps without direction), or that holds texels which are not finite. Ranges are
/// bounds: those of a texture made of others follow by interval arithmetic.
std::vector<Problem> check_textures(const SceneDescription& description, const TextureTable& textures);

}  // namespace lightmill
