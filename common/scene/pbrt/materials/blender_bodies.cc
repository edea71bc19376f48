// Blender's shader nodes whose light walks through bodies and fibres (docs/blender-materials.md), as the
// materials for that which we have.
#include <algorithm>
#include <cmath>

#include "common/scene/pbrt/materials/blender_parts.h"

namespace lightmill {
namespace {

constexpr float kShortestPath = 1e-9f;

/// Diffuse reflectance of a half space of reduced albedo a (Jensen et al., "A practical model for subsurface
/// light transport", 2001), where `a43` is 4/3 A of its boundary.
float dipole_reflectance(float a, float a43) {
  const float s = std::sqrt(3 * (1 - a));
  return 0.5f * a * (1 + std::exp(-a43 * s)) * std::exp(-s);
}

/// What Cycles multiplies a radius by: a dipole of that colour and index falls off by it.
float radius_factor(float colour, float ior) {
  const float eta = std::clamp(ior, 1.01f, 3.8f), inv = 1 / eta;
  const float returned = inv * (-1.440f * inv + 0.710f) + 0.668f + 0.0636f * eta;
  const float a43 = 4.0f / 3 * (1 + returned) / (1 - returned);
  float low = 0, high = 1;
  for (int i = 0; i < 40; ++i) {
    const float middle = 0.5f * (low + high);
    (dipole_reflectance(middle, a43) < colour ? low : high) = middle;
  }
  return std::sqrt(3 * (1 - 0.5f * (low + high)));
}

}  // namespace

SubsurfaceMaterial blender_body(const SpectrumInput& color, const Rgb& radius, float ior, float anisotropy) {
  SubsurfaceMaterial m;
  m.reflectance = color;
  m.eta = 1;  // light enters and leaves by Lambert's law
  m.g = std::clamp(anisotropy, -0.9f, 0.9f);
  const Rgb typical = color.texture < 0 ? color.value : Rgb{0.6f, 0.6f, 0.6f};
  const auto path = [&](float r, float c) {
    return std::max(r * radius_factor(std::clamp(c, 0.0f, 1.0f), ior) * (1 - m.g), kShortestPath);
  };
  m.mfp = {path(radius.r, typical.r), path(radius.g, typical.g), path(radius.b, typical.b)};
  return m;
}

SubsurfaceMaterial read_blender_subsurface(PbrtScene& out, ParameterList& params) {
  const SpectrumInput color = out.spectrum_input(params, "color", SpectrumUse::kFactor, {0.8f, 0.8f, 0.8f});
  const float scale = read_constant(out, params, "scale", 1, 0, 1e6);
  Rgb radius = read_blender_radius(out, params, "radius");
  radius = {radius.r * scale, radius.g * scale, radius.b * scale};
  const float ior = read_constant(out, params, "ior", 1.4f, 1.01, 3.8);
  params.accept({"roughness"});  // of light that enters: of no account where it does so by Lambert's law
  return blender_body(color, radius, ior, read_constant(out, params, "anisotropy", 0, 0, 1));
}

Rgb read_blender_radius(PbrtScene& out, ParameterList& params, std::string_view name) {
  const SpectrumInput radius = out.spectrum_input(params, name, SpectrumUse::kFactor, {1, 0.2f, 0.1f});
  if (radius.texture < 0) return radius.value;
  params.unsupported(name, "of a body by a texture is taken as 1 0.2 0.1");
  return {1, 0.2f, 0.1f};
}

HairMaterial read_blender_hair(PbrtScene& out, const std::string& type, ParameterList& params) {
  HairMaterial m;
  const auto roughness = [&](const char* name, float fallback) {
    return std::clamp(read_constant(out, params, name, fallback, 0, 1e6), 0.01f, 1.0f);
  };
  const auto degrees = [&](float fallback) {
    // Blender's offset is an angle, and tilts the other way.
    return std::clamp(read_constant(out, params, "offset", fallback, -2, 2) * 57.29578f, -20.0f, 20.0f);
  };
  if (type == "hair_bsdf") {
    m.reflectance = out.spectrum_input(params, "color", SpectrumUse::kReflectance, {0.8f, 0.8f, 0.8f});
    m.beta_m = roughness("roughness_u", 0.1f);
    m.beta_n = roughness("roughness_v", 1);
    m.alpha_degrees = degrees(0);
    params.text("component", "reflection");
    params.unsupported("component", "of a Hair BSDF: all lobes of a Principled Hair BSDF are taken");
    return m;
  }
  m.beta_m = roughness("roughness", 0.3f);
  m.beta_n = roughness("radial_roughness", 0.3f);
  m.eta = std::max(read_constant(out, params, "ior", 1.55f, 1, 10), 1.01f);
  m.alpha_degrees = degrees(0.0349066f);
  params.accept({"coat"});
  if (params.has("sigma_a")) {
    m.sigma_a = out.spectrum_input(params, "sigma_a", SpectrumUse::kFactor, {});
    params.accept({"color"});
  } else {
    m.reflectance = out.spectrum_input(params, "color", SpectrumUse::kReflectance, {0.017f, 0.006f, 0.002f});
  }
  return m;
}

}  // namespace lightmill
