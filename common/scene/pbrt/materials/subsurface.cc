// Material "subsurface": the ways in which pbrt lets a file say what is in the body.
#include <algorithm>
#include <cmath>

#include "common/scene/pbrt/materials/material_parts.h"
#include "common/scene/spectrum/medium_presets.h"

namespace lightmill {
namespace {

constexpr double kMostExtinction = 1e30;
/// Beyond this mean cosine a phase function is a beam that float can hardly tell from no scattering.
constexpr double kMostForwardBody = 0.99;

Rgb scaled_within_bounds(const Rgb& c, double s) {
  const auto f = [&](float x) { return static_cast<float>(std::min(double{x} * s, kMostExtinction)); };
  return {f(c.r), f(c.g), f(c.b)};
}

/// One colour of the whole body.
Rgb one_colour(PbrtScene& out, ParameterList& params, std::string_view name, const Rgb& fallback) {
  const SpectrumInput c = out.spectrum_input(params, name, SpectrumUse::kFactor, fallback);
  if (c.texture >= 0)
    params.unsupported(name, "(a texture) is taken as its default: of a body the reflectance alone may vary");
  return c.value;
}

/// pbrt's four ways, in the order in which it looks for them.
void read_medium(PbrtScene& out, ParameterList& params, SubsurfaceMaterial* m) {
  const std::string name = params.text("name", "");
  const double scale = params.number("scale", 1, 0, kMostExtinction);
  const double g = params.number("g", 0, -kMostForwardBody, kMostForwardBody);
  // Read, and so checked, even where another way goes before.
  const Rgb a = one_colour(out, params, "sigma_a", m->sigma_a),
            s = one_colour(out, params, "sigma_s", m->sigma_s), mfp = one_colour(out, params, "mfp", m->mfp);
  const SpectrumInput reflectance =
      out.spectrum_input(params, "reflectance", SpectrumUse::kReflectance, {0.5f, 0.5f, 0.5f});
  m->g = static_cast<float>(g);
  if (!name.empty()) {
    const MeasuredMedium* measured = find_measured_medium(name);
    if (measured == nullptr) {
      params.odd_value("name", "names no measured medium, and is left out: " + in_quotes(name) +
                                   nearest_hint(name, measured_medium_names()));
      return;
    }
    m->sigma_a = scaled_within_bounds(measured->sigma_a, scale);
    m->sigma_s = scaled_within_bounds(measured->reduced_sigma_s, scale);
    m->g = 0;  // which the reduced coefficient goes with
    if (g != 0) {
      out.problems->warning(params.where_of("g"), "parameter \"g\" of " + params.owner() +
                                                      " does not count beside \"name\", whose coefficients "
                                                      "are for g = 0");
    }
    return;
  }
  if (params.has("sigma_a") != params.has("sigma_s")) {
    params.odd_value(params.has("sigma_a") ? "sigma_a" : "sigma_s",
                     std::string("needs \"") + (params.has("sigma_a") ? "sigma_s" : "sigma_a") +
                         "\" beside it; pbrt's default is taken");
  }
  if (params.has("sigma_a") || params.has("sigma_s") || !params.has("reflectance")) {
    m->sigma_a = scaled_within_bounds(a, scale);
    m->sigma_s = scaled_within_bounds(s, scale);
    return;
  }
  m->reflectance = reflectance;
  m->mfp = scaled_within_bounds(mfp, scale);
  if (!(std::min({m->mfp.r, m->mfp.g, m->mfp.b}) > 0)) {
    params.odd_value(params.has("mfp") ? "mfp" : "scale",
                     "must be above 0: no body is opaque at once; a mean free path of 1 is taken");
    m->mfp = {1, 1, 1};
  }
}

}  // namespace

SubsurfaceMaterial read_subsurface(PbrtScene& out, ParameterList& params) {
  SubsurfaceMaterial m;
  m.eta = read_eta(out, params, "eta", m.eta);
  read_medium(out, params, &m);
  m.roughness = read_roughness(out, params);
  constexpr float kUnknownRoughness = 0.3f;
  for (FloatInput* r : {&m.roughness.u, &m.roughness.v}) {
    if (r->texture < 0) continue;
    *r = {kUnknownRoughness, -1};
    params.unsupported(params.has("roughness") ? "roughness" : "uroughness",
                       "(a texture) is taken as 0.3 below a subsurface material's boundary");
  }
  if (m.roughness.u.value != m.roughness.v.value) {
    params.unsupported(
        params.has("uroughness") ? "uroughness" : "vroughness",
        "differs from the other direction's: the boundary of a body is rough alike in both, by "
        "their geometric mean");
  }
  return m;
}

}  // namespace lightmill
