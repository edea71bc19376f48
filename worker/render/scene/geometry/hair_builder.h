#pragma once
// Hair's parameters from its description.
#include "worker/render/scene/render_scene.h"

namespace lightmill {

void build_hair(const HairMaterial& hair, MaterialEntry* entry, float* params);

/// Sets sigma_a from the colour that the entry's texture gives.
void set_hair_colour(const MaterialEntry& entry, const Rgb& colour, float* params);

}  // namespace lightmill
