#pragma once
// How far a scene reaches, which decides the scale that it is kept in.
#include <vector>

#include "worker/render/scene/geometry/instancing.h"

namespace lightmill {

struct SceneExtent {
  int scale_exponent = 0;  // the farthest coordinate from the origin comes to lie at 1 to 2
  // A sphere around everything, normalised; not set if the scene is empty.
  bool empty = true;
  float center[3] = {0, 0, 0};
  float radius = 0;
};

/// `world`: shapes of the scene itself; objects and instances are those of `split`; `also`: points that
/// count, too. Throws Error(kBadScene) if the scene is infinite, or has a sphere that would not stay one.
SceneExtent measure_extent(const std::vector<const ShapeDescription*>& world, const SplitScene& split,
                           const std::vector<LightDescription>& lights, const Vec3d& origin,
                           const std::vector<Vec3d>& also);

}  // namespace lightmill
