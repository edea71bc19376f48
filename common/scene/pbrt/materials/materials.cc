// Material and MakeNamedMaterial.
#include "common/scene/pbrt/v3/materials.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/error.h"
#include "common/scene/measured/measured_table.h"
#include "common/scene/pbrt/materials/material_parts.h"
#include "common/scene/spectrum/spectrum.h"

namespace lightmill {
namespace {

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
        params.odd_value(other, "can't be given together with \"reflectance\", which counts");
    }
  }
  m.eta = out.spectrum_input(params, names.eta, SpectrumUse::kFactor, *named_metal(kDefaultMetal[0]));
  m.k = out.spectrum_input(params, names.k, SpectrumUse::kFactor, *named_metal(kDefaultMetal[1]));
  params.accept({"reflectance"});
  const Rgb &eta = m.eta.value, &k = m.k.value;
  if (m.eta.texture < 0 && m.k.texture < 0 && (eta.r + k.r <= 0 || eta.g + k.g <= 0 || eta.b + k.b <= 0)) {
    params.odd_value(names.eta, "must be above 0 where k is 0: no matter has an index of 0; 1 is taken");
    for (const auto channel : {&Rgb::r, &Rgb::g, &Rgb::b}) {
      if (eta.*channel + k.*channel <= 0) m.eta.value.*channel = 1;
    }
  }
  m.roughness = read_roughness(out, params, names.roughness);
  return m;
}

/// What a layered material's coat has besides its index and roughness.
template <class Coated>
void read_coat(PbrtScene& out, ParameterList& params, Coated* m) {
  m->thickness = read_constant(out, params, "thickness", 0.01f, 0, 1e6);
  m->max_depth = static_cast<int>(params.integer("maxdepth", 10, 1, 1000));
  params.accept({"nsamples"});  // no samples are needed
  // pbrt's own bounds would let g reach 1, where light goes straight on.
  m->medium.g = read_constant(out, params, "g", 0, -0.99, 0.99);
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

/// "normalmap" (an image, always linear, or, as no pbrt has it, a spectrum texture) and "displacement" (a
/// float texture; a constant lifts all alike).
void read_bumps(PbrtScene& out, ParameterList& params, MaterialDescription* material) {
  const Parameter* given = params.find("normalmap", {ParamType::kString, ParamType::kTexture});
  if (given && given->type == ParamType::kTexture) {
    material->normal_map = out.spectrum_input(params, "normalmap", SpectrumUse::kFactor, {}).texture;
  } else if (const std::string file = params.text("normalmap", ""); !file.empty()) {
    ImageTexture image;
    image.encoding = ColorEncoding::kLinear;
    if (const auto path = out.open_image(file, params.where_of("normalmap"))) {
      image.path = *path;
      material->normal_map = static_cast<int>(out.scene.textures.size());
      out.scene.textures.push_back({"", true, image, params.where_of("normalmap")});
    }
  }
  material->displacement = out.float_input(params, "displacement", 0, -kMaxHeight, kMaxHeight).texture;
  // Ours, not pbrt's.
  material->shading_normal = out.spectrum_input(params, "normal", SpectrumUse::kFactor, {}).texture;
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

MaterialKind read_measured(PbrtScene& out, ParameterList& params) {
  const std::string file = params.text("filename", "");
  if (out.dialect == Dialect::kV3) {  // v2's, in MERL's format
    out.problems->unsupported(params.where(), params.owner() + " of pbrt-v2 is rendered grey");
    return DiffuseMaterial{};
  }
  if (file.empty()) {
    params.bad_value("filename", "must name a file of a measured BSDF (.bsdf)");
    return MeasuredMaterial{};
  }
  const SourceLocation where = params.where_of("filename");
  const std::string path = out.open_reference(file, where);
  if (path.empty()) return MeasuredMaterial{};
  const auto [known, is_new] = out.measured.try_emplace(path);  // a broken file is reported once
  if (!is_new) return MeasuredMaterial{known->second};
  try {
    known->second = std::make_shared<MeasuredTable>(read_measured_file(path));
  } catch (const Error& e) {
    out.problems->error(where, "the measured BSDF " + in_quotes(file) + " " + e.what());
  } catch (const std::bad_alloc&) {
    out.problems->error(where, "the measured BSDF " + in_quotes(file) + " does not fit into memory");
  }
  return MeasuredMaterial{known->second};
}

MixMaterial read_mix(PbrtScene& out, ParameterList& params) {
  MixMaterial m;
  m.materials = read_two_materials(out, params);
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
  } else if (type == "disney") {
    material.kind = v3::read_disney(out, params);
  } else if (is_one_of(type, blender_materials())) {
    material.bump_by_pixel = true;
    material.tangent = out.spectrum_input(params, "tangent", SpectrumUse::kFactor, {}).texture;
    material.bump_strength = out.float_input(params, "bump_strength", 1, 0, 1e6);
    material.kind = read_blender_material(out, type, params, material);
  } else if (type == "coatedconductor") {
    material.kind = read_coated_conductor(out, params);
  } else {
    if (is_interface_material(type)) return material;  // nothing is seen of it
    report_unknown_word(params, "material", type, known_materials(), "grey is taken");
    return material;  // its parameters are another material's: not checked
  }
  // pbrt has no bump over a normal map; Blender has.
  if (material.normal_map >= 0 && !material.bump_by_pixel) material.displacement = -1;
  params.finish();
  return material;
}

}  // namespace lightmill
