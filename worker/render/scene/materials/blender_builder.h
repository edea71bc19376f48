#pragma once
// Materials that are Blender's shader nodes (bsdf/blender/): descriptions to parameters.
#include <cmath>
#include <functional>

#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Reflectance of a Holdout, which is black like +0 and told from it by its sign: it has no alpha in the
/// picture.
inline constexpr float kHoldoutReflectance = -0.0f;

void build_principled(const PrincipledMaterial& m, RenderScene* scene, MaterialEntry* entry, float* params);
void build_closure(const ClosureMaterial& m, RenderScene* scene, MaterialEntry* entry, float* params);

/// Overwrites the parameters of a textured one at a point.
void apply_blender_textures(const RenderScene& scene, const MaterialEntry& entry, const TexturePoint& at,
                            float* params);

/// Calls visit(texture) for the textures of its inputs; -1 where there is none.
void visit_blender_textures(const RenderScene& scene, const MaterialEntry& entry,
                            const std::function<void(int)>& visit);

}  // namespace lightmill
