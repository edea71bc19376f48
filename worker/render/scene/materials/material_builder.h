#pragma once
// Turns a material's description into a table entry: kind, constant parameters, textures.
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Appends `materials` to scene.materials, material_params and material_kind, and their tables to
/// scene.bsdf_tables. The scene must have none yet.
void add_materials(const std::vector<MaterialDescription>& materials, RenderScene* scene);

}  // namespace lightmill
