#pragma once
// From a material's description to a table entry: kind, constant parameters, textures.
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Appends `materials` to scene.materials, material_params and material_kind, and what they need to
/// scene.bsdf_tables. Before, the scene has none.
void add_materials(const std::vector<MaterialDescription>& materials, RenderScene* scene);

}  // namespace lightmill
