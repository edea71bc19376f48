#pragma once
// Parameters and bodies of subsurface materials, constant or at a textured point (bsdf/subsurface.h).
#include "worker/render/scene/materials/coat_builder.h"

namespace lightmill {

/// Throws Error(kBadScene), with the material's place, if the medium is too dense for float.
void build_subsurface(const MaterialDescription& material, CoatMemo* coats, RenderScene* scene,
                      MaterialEntry* entry, float* params);

/// Sets the albedo from the reflectance of a textured point.
void set_subsurface_reflectance(const RenderScene& scene, const Rgb& reflectance, float* params);

}  // namespace lightmill
