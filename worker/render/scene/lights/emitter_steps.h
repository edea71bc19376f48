#pragma once
// Where triangles that emit and move are at even times of the exposure.
#include <vector>

#include "worker/render/scene/geometry/geometry_builder.h"

namespace lightmill {

/// The steps (LightTable::set_moving) of `emitter`, whose object is that of moving instance `instance`: in
/// normalised space, as many as its way or its mesh has, whichever are more.
std::vector<float> emitter_steps(const RenderScene& scene, const ObjectEmitter& emitter, int32_t instance);

}  // namespace lightmill
