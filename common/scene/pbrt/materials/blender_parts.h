#pragma once
// Those of Blender's shader nodes that become materials of pbrt's: bodies and fibres.
#include "common/scene/pbrt/materials/material_parts.h"

namespace lightmill {

/// A body of this colour, whose light goes about `radius` (scene units) far, as a random walk of Cycles 3.4.
SubsurfaceMaterial blender_body(const SpectrumInput& color, const Rgb& radius, float ior, float anisotropy);
/// A radius by channel; one of a texture is reported.
Rgb read_blender_radius(PbrtScene& out, ParameterList& params, std::string_view name);

SubsurfaceMaterial read_blender_subsurface(PbrtScene& out, ParameterList& params);
HairMaterial read_blender_hair(PbrtScene& out, const std::string& type, ParameterList& params);

}  // namespace lightmill
