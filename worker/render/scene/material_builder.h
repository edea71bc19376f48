#pragma once
// From a material's description to a table entry: kind, constant parameters, textures.
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Puts what has a fixed place there into scene.bsdf_tables; once, before materials are added.
void begin_tables(const std::vector<MaterialDescription>& materials, RenderScene* scene);
/// Appends `material` to scene.materials, material_params and material_kind.
void add_material(const MaterialDescription& material, RenderScene* scene);

}  // namespace lightmill
