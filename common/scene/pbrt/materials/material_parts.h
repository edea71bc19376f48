#pragma once
// What several of pbrt's materials have: roughness, index, numbers that may be textures.
#include <array>
#include <string_view>

#include "common/scene/pbrt/scene.h"

namespace lightmill {

/// Names of the parameters of one roughness; literals, as the list of known names keeps them.
struct RoughnessNames {
  std::string_view both = "roughness", u = "uroughness", v = "vroughness";
};

/// Both directions of a roughness; what is above 1 is warned of and taken as 1.
Roughness read_roughness(PbrtScene& out, ParameterList& params, const RoughnessNames& names = {});
/// Layers of a textured roughness are round: one that differs by direction is warned of.
void warn_of_anisotropy(ParameterList& params, const Roughness& r, const RoughnessNames& names = {});
/// A dielectric's index: a float, or a spectrum reduced to one number.
float read_eta(PbrtScene& out, ParameterList& params, std::string_view name = "eta", float fallback = 1.5f);
/// A number that pbrt allows to be a texture, which we take at one value.
float read_constant(PbrtScene& out, ParameterList& params, std::string_view name, float fallback, double low,
                    double high);

/// The two materials that one is made of, by their names; grey ones where these are not given.
std::array<int, 2> read_two_materials(PbrtScene& out, ParameterList& params);

/// Names of the materials that are Blender's shader nodes, and one of them. `like` has what its parts share
/// with it: its place, its bumps.
const std::vector<std::string_view>& blender_materials();
MaterialKind read_blender_material(PbrtScene& out, const std::string& type, ParameterList& params,
                                   const MaterialDescription& like);

/// Material "subsurface".
SubsurfaceMaterial read_subsurface(PbrtScene& out, ParameterList& params);

}  // namespace lightmill
