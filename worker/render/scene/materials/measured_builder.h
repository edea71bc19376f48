#pragma once
// Makes the tables of measured BRDFs for their kernels (bsdf/measured.h).
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Appends the tables of all measured materials to the scene's, and sets the parameter that says where they
/// are, in units of kMeasuredUnit. The scene must have the materials. A table that several materials share is
/// there once. A slice without any value is sampled evenly. Throws Error(kBadScene) if the tables become too
/// large.
void add_measured(const std::vector<MaterialDescription>& materials, RenderScene* scene);

}  // namespace lightmill
