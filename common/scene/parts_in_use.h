#pragma once
// Which materials and textures of a scene something that is there reads; the rest is not loaded.
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// By their indices in the description.
struct PartsInUse {
  std::vector<bool> materials, textures;
};

/// What shapes of the scene and of instanced objects are made of: their materials, those that these mix,
/// their alpha masks, what emitters show, and the textures that all of it is made of.
PartsInUse parts_in_use(const SceneDescription& scene);

}  // namespace lightmill
