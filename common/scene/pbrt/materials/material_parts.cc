#include "common/scene/pbrt/materials/material_parts.h"

#include <utility>

#include "common/scene/spectrum/spectrum.h"

namespace lightmill {
namespace {

constexpr double kMaxEta = 100;

}  // namespace

Roughness read_roughness(PbrtScene& out, ParameterList& params, const RoughnessNames& names) {
  const FloatInput both = out.float_input(params, names.both, 0, 0, 1e6);
  Roughness r;
  r.u = params.has(names.u) ? out.float_input(params, names.u, 0, 0, 1e6) : both;
  r.v = params.has(names.v) ? out.float_input(params, names.v, 0, 0, 1e6) : both;
  params.accept({names.u, names.v});
  r.remap = params.boolean("remaproughness", true);
  const std::pair<std::string_view, FloatInput*> directions[] = {
      {params.has(names.u) ? names.u : names.both, &r.u}, {params.has(names.v) ? names.v : names.both, &r.v}};
  for (const auto& [name, input] : directions) {
    if (input->texture >= 0 || input->value <= 1) continue;
    // Both directions may come from one parameter: one line is enough.
    if (input == &r.u || directions[0].first != name) {
      out.problems->warning(params.where_of(name), "parameter " + in_quotes(std::string(name)) + " of " +
                                                       params.owner() + " is " +
                                                       std::to_string(input->value) +
                                                       "; the roughest surface has 1, which is taken");
    }
    input->value = 1;
  }
  return r;
}

float read_eta(PbrtScene& out, ParameterList& params, std::string_view name, float fallback) {
  const Parameter* p = params.find(name, {ParamType::kFloat, ParamType::kSpectrum, ParamType::kRgb});
  if (p == nullptr) return fallback;
  float eta = fallback;
  if (p->type == ParamType::kFloat) {
    eta = static_cast<float>(params.number(name, double{fallback}, 1e-3, kMaxEta));
  } else {
    const Rgb c = out.spectrum(params, name, SpectrumUse::kFactor, {fallback, fallback, fallback});
    eta = c.g;
    const std::optional<float> glass = p->strings.empty() ? std::nullopt : named_glass(p->strings[0]);
    if (glass || c.r != c.b || c.r != c.g) {
      out.problems->unsupported(p->where, "dispersion: parameter " + in_quotes(std::string(name)) + " of " +
                                              params.owner() + " is taken as the one number " +
                                              std::to_string(eta));
    }
  }
  if (!(eta > 0)) {
    params.odd_value(name, "must be above 0; " + std::to_string(fallback) + " is taken");
    return fallback;
  }
  return eta;
}

void warn_of_anisotropy(ParameterList& params, const Roughness& r, const RoughnessNames& names) {
  if (r.u.texture == r.v.texture) return;
  params.unsupported(params.has(names.u) ? names.u : names.v,
                     "differs from the other direction's; by a texture; then a layer is rough alike in both, "
                     "by their geometric mean");
}

float read_constant(PbrtScene& out, ParameterList& params, std::string_view name, float fallback, double low,
                    double high) {
  const FloatInput x = out.float_input(params, name, fallback, low, high);
  if (x.texture >= 0) params.unsupported(name, "(a texture) is taken as " + std::to_string(fallback));
  return x.texture >= 0 ? fallback : x.value;
}

std::array<int, 2> read_two_materials(PbrtScene& out, ParameterList& params) {
  std::array<int, 2> materials;
  const Parameter* p = params.find("materials", {ParamType::kString});
  if (p == nullptr || p->strings.size() != 2) {
    params.odd_value("materials", "needs the names of two materials; grey is taken");
    materials.fill(out.default_material(params.where()));
  } else {
    for (size_t i = 0; i < 2; ++i) materials[i] = out.material_named(p->strings[i], p->where);
  }
  return materials;
}

}  // namespace lightmill
