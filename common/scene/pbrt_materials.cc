// Material and MakeNamedMaterial.
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/error.h"
#include "common/scene/measured_table.h"
#include "common/scene/medium_presets.h"
#include "common/scene/pbrt_scene.h"
#include "common/scene/spectrum.h"

namespace lightmill {
namespace {

constexpr double kMaxEta = 100;
constexpr double kMaxHeight = 3e38;  // any float
constexpr const char* kDefaultMetal[] = {"metal-Cu-eta", "metal-Cu-k"};

const std::vector<std::string_view>& known_materials() {
  static const std::vector<std::string_view> names = {"diffuse",
                                                      "conductor",
                                                      "dielectric",
                                                      "coateddiffuse",
                                                      "coatedconductor",
                                                      "diffusetransmission",
                                                      "thindielectric",
                                                      "hair",
                                                      "measured",
                                                      "subsurface",
                                                      "mix",
                                                      "interface"};
  return names;
}

/// pbrt-v4's name of a material that only pbrt-v3 has, or "".
std::string_view successor_of(std::string_view type) {
  constexpr std::string_view kRenamed[][2] = {
      {"matte", "diffuse"},           {"plastic", "coateddiffuse"},
      {"substrate", "coateddiffuse"}, {"uber", "coateddiffuse"},
      {"glass", "dielectric"},        {"metal", "conductor"},
      {"mirror", "conductor"},        {"translucent", "diffusetransmission"}};
  for (const auto& [old_name, new_name] : kRenamed) {
    if (old_name == type) return new_name;
  }
  return "";
}

/// Names of the parameters of one roughness; literals, as the list of known names keeps them.
struct RoughnessNames {
  std::string_view both = "roughness", u = "uroughness", v = "vroughness";
};

Roughness read_roughness(PbrtScene& out, ParameterList& params, const RoughnessNames& names = {}) {
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

/// A dielectric's index: a float, or a spectrum reduced to one number.
float read_eta(PbrtScene& out, ParameterList& params, std::string_view name = "eta") {
  const Parameter* p = params.find(name, {ParamType::kFloat, ParamType::kSpectrum});
  if (p == nullptr) return 1.5f;
  float eta = 1.5f;
  if (p->type == ParamType::kFloat) {
    eta = static_cast<float>(params.number(name, 1.5, 1e-3, kMaxEta));
  } else {
    const Rgb c = out.spectrum(params, name, SpectrumUse::kFactor, {1.5f, 1.5f, 1.5f});
    eta = c.g;
    const std::optional<float> glass = p->strings.empty() ? std::nullopt : named_glass(p->strings[0]);
    if (glass || c.r != c.b) {
      out.problems->unsupported(p->where, "dispersion: parameter " + in_quotes(std::string(name)) + " of " +
                                              params.owner() + " is taken as the one number " +
                                              std::to_string(eta));
    }
  }
  if (!(eta > 0)) {
    params.bad_value(name, "must be above 0");
    return 1.5f;
  }
  return eta;
}

/// Names of a metal's parameters.
struct MetalNames {
  const char *eta = "eta", *k = "k";
  RoughnessNames roughness;
};

ConductorMaterial read_conductor(PbrtScene& out, ParameterList& params, const MetalNames& names = {}) {
  ConductorMaterial m;
  if (params.has("reflectance")) {
    m.reflectance = out.spectrum_input(params, "reflectance", SpectrumUse::kReflectance, {0.5f, 0.5f, 0.5f});
    for (const char* other : {names.eta, names.k}) {
      if (params.has(other))
        params.bad_value(other, "can't be given together with \"reflectance\"; keep one of them");
    }
  }
  m.eta = out.spectrum_input(params, names.eta, SpectrumUse::kFactor, *named_metal(kDefaultMetal[0]));
  m.k = out.spectrum_input(params, names.k, SpectrumUse::kFactor, *named_metal(kDefaultMetal[1]));
  params.accept({"reflectance"});
  const Rgb &eta = m.eta.value, &k = m.k.value;
  if (m.eta.texture < 0 && m.k.texture < 0 && (eta.r + k.r <= 0 || eta.g + k.g <= 0 || eta.b + k.b <= 0)) {
    params.bad_value(names.eta, "must be above 0 where k is 0: no matter has an index of 0");
  }
  m.roughness = read_roughness(out, params, names.roughness);
  return m;
}

/// Layers of a textured roughness are round: one that differs by direction is warned of.
void warn_of_anisotropy(ParameterList& params, const Roughness& r, const RoughnessNames& names = {}) {
  if (r.u.texture == r.v.texture) return;
  params.unsupported(params.has(names.u) ? names.u : names.v,
                     "differs from the other direction's; by a texture; then a layer is rough alike in both, "
                     "by their geometric mean");
}

/// What a layered material's coat has besides its index and roughness.
template <class Coated>
void read_coat(PbrtScene& out, ParameterList& params, Coated* m) {
  m->thickness = static_cast<float>(params.number("thickness", 0.01, 0, 1e6));
  m->max_depth = static_cast<int>(params.integer("maxdepth", 10, 1, 1000));
  params.accept({"nsamples"});  // no samples are needed
  // pbrt's own bounds would let g reach 1, where light goes straight on.
  m->medium.g = static_cast<float>(params.number("g", 0, -0.99, 0.99));
  const SpectrumInput albedo = out.spectrum_input(params, "albedo", SpectrumUse::kReflectance, {});
  if (albedo.texture >= 0) {
    params.unsupported("albedo", "of a coat by a texture is ignored: it takes one colour");
  } else {
    m->medium.albedo = albedo.value;
  }
}

CoatedConductorMaterial read_coated_conductor(PbrtScene& out, ParameterList& params) {
  CoatedConductorMaterial m;
  const RoughnessNames of_metal{"conductor.roughness", "conductor.uroughness", "conductor.vroughness"},
      of_coat{"interface.roughness", "interface.uroughness", "interface.vroughness"};
  m.conductor = read_conductor(out, params, {"conductor.eta", "conductor.k", of_metal});
  m.eta = read_eta(out, params, "interface.eta");
  m.coat_roughness = read_roughness(out, params, of_coat);
  warn_of_anisotropy(params, m.conductor.roughness, of_metal);
  warn_of_anisotropy(params, m.coat_roughness, of_coat);
  for (FloatInput* r : {&m.coat_roughness.u, &m.coat_roughness.v}) {
    if (r->texture < 0) continue;
    *r = {0.3f, -1};
    params.unsupported("interface.roughness", "(a texture) is taken as 0.3");
  }
  read_coat(out, params, &m);
  const ConductorMaterial& metal = m.conductor;
  const bool textured =
      metal.reflectance ? metal.reflectance->texture >= 0 : metal.eta.texture >= 0 || metal.k.texture >= 0;
  if (textured && !(m.medium.albedo == Rgb{})) {
    m.medium = {};
    params.unsupported("albedo", "of a coat is ignored over a metal whose index or reflectance is a texture");
  }
  return m;
}

CoatedDiffuseMaterial read_coated_diffuse(PbrtScene& out, ParameterList& params) {
  CoatedDiffuseMaterial m;
  m.reflectance = out.spectrum_input(params, "reflectance", SpectrumUse::kReflectance, {0.5f, 0.5f, 0.5f});
  m.eta = read_eta(out, params);
  m.roughness = read_roughness(out, params);
  warn_of_anisotropy(params, m.roughness);
  read_coat(out, params, &m);
  return m;
}

DiffuseTransmissionMaterial read_diffuse_transmission(PbrtScene& out, ParameterList& params) {
  constexpr Rgb kQuarter{0.25f, 0.25f, 0.25f};
  DiffuseTransmissionMaterial m;
  m.reflectance = out.spectrum_input(params, "reflectance", SpectrumUse::kReflectance, kQuarter);
  m.transmittance = out.spectrum_input(params, "transmittance", SpectrumUse::kReflectance, kQuarter);
  m.scale = static_cast<float>(params.number("scale", 1, 0, 1e6));
  if (m.reflectance.texture < 0 && m.transmittance.texture < 0) {
    const Rgb &r = m.reflectance.value, &t = m.transmittance.value;
    const float sum = m.scale * std::max({r.r + t.r, r.g + t.g, r.b + t.b});
    if (sum > 1 + 1e-6f) {
      out.problems->warning(params.where(),
                            params.owner() + " reflects and transmits " + std::to_string(sum) +
                                " times the light it gets; both are scaled down to a sum of 1");
    }
  }
  return m;
}

/// "normalmap" (an image, always linear) and "displacement" (a float texture; a constant lifts all alike).
void read_bumps(PbrtScene& out, ParameterList& params, MaterialDescription* material) {
  if (const std::string file = params.text("normalmap", ""); !file.empty()) {
    ImageTexture image;
    image.encoding = ColorEncoding::kLinear;
    if (const auto path = out.open_image(file, params.where_of("normalmap"))) {
      image.path = *path;
      material->normal_map = static_cast<int>(out.scene.textures.size());
      out.scene.textures.push_back({"", true, image, params.where_of("normalmap")});
    }
  }
  material->displacement = out.float_input(params, "displacement", 0, -kMaxHeight, kMaxHeight).texture;
}

/// A number that pbrt allows to be a texture, which we take at one value.
float read_constant(PbrtScene& out, ParameterList& params, std::string_view name, float fallback, double low,
                    double high) {
  const FloatInput x = out.float_input(params, name, fallback, low, high);
  if (x.texture >= 0) params.unsupported(name, "(a texture) is taken as " + std::to_string(fallback));
  return x.texture >= 0 ? fallback : x.value;
}

HairMaterial read_hair(PbrtScene& out, ParameterList& params) {
  HairMaterial m;
  m.eta = read_constant(out, params, "eta", 1.55f, 1.01, 10);
  const auto roughness = [&](const char* name) {
    return std::clamp(read_constant(out, params, name, 0.3f, 0, 1e6), 0.01f, 1.0f);
  };
  m.beta_m = roughness("beta_m");
  m.beta_n = roughness("beta_n");
  m.alpha_degrees = read_constant(out, params, "alpha", 2, -20, 20);
  // Concentrations of the pigments (d'Eon et al. 2011).
  const bool pigments = params.has("eumelanin") || params.has("pheomelanin");
  const float eu = read_constant(out, params, "eumelanin", pigments ? 0.0f : 1.3f, 0, 1e6),
              pheo = read_constant(out, params, "pheomelanin", 0, 0, 1e6);
  m.sigma_a.value = {eu * 0.419f + pheo * 0.187f, eu * 0.697f + pheo * 0.4f, eu * 1.37f + pheo * 1.05f};
  const char* colour = params.has("reflectance") ? "reflectance" : "color";
  if (params.has(colour) && !params.has("sigma_a"))
    m.reflectance = out.spectrum_input(params, colour, SpectrumUse::kReflectance, {0.5f, 0.5f, 0.5f});
  if (params.has("sigma_a")) m.sigma_a = out.spectrum_input(params, "sigma_a", SpectrumUse::kFactor, {});
  params.accept({"reflectance", "color", "sigma_a"});
  return m;
}

/// Share of diffuse light inside of a smooth boundary of index `eta` that it keeps, by Simpson's rule over
/// the cosine.
double diffuse_internal_reflectance(double eta) {
  const auto reflectance = [&](double cosine) {  // from outside
    const double t = std::sqrt(1 - (1 - cosine * cosine) / (eta * eta));
    const double s = (cosine - eta * t) / (cosine + eta * t), p = (eta * cosine - t) / (eta * cosine + t);
    return (s * s + p * p) / 2;
  };
  constexpr int kSteps = 200;
  double sum = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double c = static_cast<double>(i) / kSteps, f = reflectance(c) * 2 * c;
    sum += f * (i == 0 || i == kSteps ? 1 : i % 2 ? 4 : 2) / (3.0 * kSteps);
  }
  return 1 - (1 - sum) / (eta * eta);
}

/// Diffuse reflectance of a half space of reduced albedo `a` behind a boundary that keeps `internal` of what
/// meets it from inside (Jensen et al. 2001, eq. 15).
double half_space_reflectance(double a, double internal) {
  const double root = std::sqrt(3 * (1 - a)), boundary = (1 + internal) / (1 - internal);
  return a / 2 * (1 + std::exp(-4.0 / 3 * boundary * root)) * std::exp(-root);
}

/// A coat over a diffuse base that reflects as much as the half space of the medium would: light leaves where
/// it came in.
CoatedDiffuseMaterial read_subsurface(PbrtScene& out, ParameterList& params) {
  CoatedDiffuseMaterial m;
  m.eta = params.has("eta") ? read_eta(out, params) : 1.33f;
  params.accept({"eta", "mfp", "scale"});
  m.eta = std::max(m.eta, 1.001f);
  m.roughness = read_roughness(out, params);
  warn_of_anisotropy(params, m.roughness);
  m.thickness = 0;
  m.max_depth = 1000;
  double g = params.number("g", 0, -0.999, 0.999);
  Rgb sigma_a{.0011f, .0024f, .014f}, sigma_s{2.55f, 3.21f, 3.77f};
  const std::string name = params.text("name", "");
  if (const MeasuredMedium* measured = name.empty() ? nullptr : find_measured_medium(name)) {
    sigma_a = measured->sigma_a;
    sigma_s = measured->reduced_sigma_s;
    g = 0;
  } else if (!name.empty()) {
    params.bad_value(
        "name", "names no measured medium: " + in_quotes(name) + nearest_hint(name, measured_medium_names()));
  }
  const bool by_reflectance = params.has("reflectance") && name.empty() && !params.has("sigma_a");
  const SpectrumInput reflectance =
      out.spectrum_input(params, "reflectance", SpectrumUse::kReflectance, {0.5f, 0.5f, 0.5f});
  const SpectrumInput a = out.spectrum_input(params, "sigma_a", SpectrumUse::kFactor, sigma_a),
                      s = out.spectrum_input(params, "sigma_s", SpectrumUse::kFactor, sigma_s);
  const double internal = diffuse_internal_reflectance(double{m.eta});
  const auto base = [&](double total) {
    return static_cast<float>(total / (1 - internal + total * internal));
  };
  if (by_reflectance) {
    const Rgb& r = reflectance.value;
    m.reflectance = {{base(double{r.r}), base(double{r.g}), base(double{r.b})}, reflectance.texture};
  } else {
    const auto channel = [&](float absorbs, float scatters) {
      const double reduced = double{scatters} * (1 - g), sum = reduced + double{absorbs};
      return base(half_space_reflectance(sum > 0 ? reduced / sum : 0, internal));
    };
    const Rgb &ka = name.empty() ? a.value : sigma_a, &ks = name.empty() ? s.value : sigma_s;
    m.reflectance.value = {channel(ka.r, ks.r), channel(ka.g, ks.g), channel(ka.b, ks.b)};
  }
  out.problems->unsupported(params.where(), params.owner() +
                                                " of type \"subsurface\" reflects as much, but "
                                                "light leaves it where it came in");
  return m;
}

MeasuredMaterial read_measured(PbrtScene& out, ParameterList& params) {
  const std::string file = params.text("filename", "");
  if (file.empty()) {
    params.bad_value("filename", "must name a file of a measured BSDF (.bsdf)");
    return {};
  }
  const SourceLocation where = params.where_of("filename");
  const std::string path = out.open_reference(file, where);
  if (path.empty()) return {};
  const auto [known, is_new] = out.measured.try_emplace(path);  // a broken file is reported once
  if (!is_new) return {known->second};
  try {
    known->second = std::make_shared<MeasuredTable>(read_measured_file(path));
  } catch (const Error& e) {
    out.problems->error(where, "the measured BSDF " + in_quotes(file) + " " + e.what());
  } catch (const std::bad_alloc&) {
    out.problems->error(where, "the measured BSDF " + in_quotes(file) + " does not fit into memory");
  }
  return {known->second};
}

MixMaterial read_mix(PbrtScene& out, ParameterList& params) {
  MixMaterial m;
  const Parameter* p = params.find("materials", {ParamType::kString});
  if (p == nullptr || p->strings.size() != 2) {
    params.bad_value("materials", "needs the names of two materials");
    m.materials.fill(out.default_material(params.where()));
  } else {
    for (size_t i = 0; i < 2; ++i) m.materials[i] = out.material_named(p->strings[i], p->where);
  }
  m.amount = out.float_input(params, "amount", 0.5f, 0, 1);
  return m;
}

}  // namespace

bool is_interface_material(const std::string& type) {
  return type == "interface" || type == "" || type == "none";
}

MaterialDescription translate_material(PbrtScene& out, const std::string& type, ParameterList& params) {
  MaterialDescription material{"", DiffuseMaterial{}, params.where()};
  read_bumps(out, params, &material);
  if (type == "diffuse") {
    material.kind = DiffuseMaterial{
        out.spectrum_input(params, "reflectance", SpectrumUse::kReflectance, {0.5f, 0.5f, 0.5f})};
  } else if (type == "conductor") {
    material.kind = read_conductor(out, params);
  } else if (type == "dielectric") {
    DielectricMaterial m;
    m.eta = read_eta(out, params);
    m.roughness = read_roughness(out, params);
    material.kind = m;
  } else if (type == "thindielectric") {
    material.kind = ThinDielectricMaterial{read_eta(out, params)};
  } else if (type == "diffusetransmission") {
    material.kind = read_diffuse_transmission(out, params);
  } else if (type == "coateddiffuse") {
    material.kind = read_coated_diffuse(out, params);
  } else if (type == "subsurface") {
    material.kind = read_subsurface(out, params);
  } else if (type == "hair") {
    material.kind = read_hair(out, params);
  } else if (type == "measured") {
    material.kind = read_measured(out, params);
  } else if (type == "mix") {
    material.kind = read_mix(out, params);
  } else if (type == "coatedconductor") {
    material.kind = read_coated_conductor(out, params);
  } else {
    if (is_interface_material(type)) return material;  // nothing is seen of it
    const std::string_view successor = successor_of(type);
    if (successor.empty()) {
      report_unknown_word(params, "material", type, known_materials());
    } else {
      out.problems->error(params.where(), "unknown material " + in_quotes(type) +
                                              " (of pbrt-v3); pbrt-v4 calls it " + in_quotes(successor));
    }
    return material;  // its parameters are another material's: not checked
  }
  params.finish();
  return material;
}

}  // namespace lightmill
