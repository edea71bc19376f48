#include <cmath>

#include "common/scene/pbrt/materials/material_parts.h"
#include "common/scene/pbrt/v3/materials.h"

namespace lightmill::v3 {
namespace {

/// A number that is told of if it is not 0: there is nothing here for it.
void leave_out(PbrtScene& out, ParameterList& params, const char* name) {
  const FloatInput x = out.float_input(params, name, 0, -kAnySize, kAnySize);
  if (x.texture >= 0 || x.value != 0) params.unsupported(name, "is left out");
}

}  // namespace

MaterialKind read_disney(PbrtScene& out, ParameterList& params) {
  const SpectrumInput color =
      out.spectrum_input(params, "color", SpectrumUse::kReflectance, {0.5f, 0.5f, 0.5f});
  const FloatInput roughness = out.float_input(params, "roughness", 0.5f, 0, 1);
  const float eta = read_eta(out, params, "eta", 1.5f);
  const FloatInput clear = out.float_input(params, "spectrans", 0, 0, 1);
  const bool thin = params.boolean("thin", false);
  const auto rest = [&] {
    for (const char* name : {"speculartint", "sheentint", "flatness"}) leave_out(out, params, name);
    params.accept({"scatterdistance"});
    if (params.has("scatterdistance")) params.unsupported("scatterdistance", "is left out");
  };
  if (clear.texture < 0 && clear.value > 0.5f) {
    TransmissionMaterial glass;
    glass.color = color;
    glass.roughness = roughness;
    glass.ior = eta;
    glass.thin = thin;
    params.accept({"metallic", "anisotropic", "clearcoat", "clearcoatgloss", "sheen", "difftrans"});
    rest();
    return glass;
  }
  if (clear.texture >= 0 || clear.value > 0) params.unsupported("spectrans", "of 0.5 or less is left out");
  MetallicRoughnessMaterial m;
  m.base_color = color;
  m.roughness = roughness;
  m.metallic = out.float_input(params, "metallic", 0, 0, 1);
  m.ior = eta;
  m.clearcoat = out.float_input(params, "clearcoat", 0, 0, 1);
  // Disney's gloss of 0 and 1 are alphas of 0.1 and 0.001, whose roots are glTF's roughness.
  const float gloss = read_constant(out, params, "clearcoatgloss", 1, 0, 1);
  m.clearcoat_roughness = {std::sqrt(0.1f + (0.001f - 0.1f) * gloss), -1};
  const FloatInput sheen = out.float_input(params, "sheen", 0, 0, 1);
  if (sheen.texture < 0) {
    m.sheen_color.value = {sheen.value, sheen.value, sheen.value};
    m.sheen_roughness = {0.5f, -1};
  } else {
    params.unsupported("sheen", "(a texture) is left out");
  }
  m.anisotropy = read_constant(out, params, "anisotropic", 0, 0, 1);
  const FloatInput through = out.float_input(params, "difftrans", 0, 0, 2);
  if (thin && through.texture < 0) m.translucence = {through.value / 2, -1};
  rest();
  return m;
}

}  // namespace lightmill::v3
