#include "common/scene/pbrt/v3/materials.h"

#include <algorithm>
#include <array>
#include <map>

#include "common/scene/pbrt/v3/edit.h"

namespace lightmill::v3 {
namespace {

struct Rewrite {
  SourceLocation where;
  std::string* type;
  std::vector<Parameter>* parameters;
  ProblemList* problems;
  const std::string old_type = *type;
  Edit edit{where, parameters};

  void warn(const std::string& message) const {
    problems->warning(where, "material " + in_quotes(old_type) + " of pbrt-v3 " + message);
  }
  /// Removes a parameter that pbrt-v4's material lacks; silent if it has the value of no effect.
  void drop(const char* name, double without_effect) {
    const Parameter* const p = edit.find(name);
    if (p == nullptr) return;
    if (grey_value(*p) != without_effect)
      warn("is read without its " + in_quotes(name) + ", as by pbrt-v4's --upgrade");
    edit.remove({name});
  }
  bool is(const char* name, double value) {
    const Parameter* const p = edit.find(name);
    return p != nullptr && grey_value(*p) == value;
  }
  /// Of a colour: whether there is any.
  bool any(const char* name) {
    const Parameter* const p = edit.find(name);
    return p != nullptr && !is(name, 0);
  }
};

void matte(Rewrite& w) {
  *w.type = "diffuse";
  w.drop("sigma", 0);  // Oren and Nayar's roughness
  w.edit.rename("Kd", "reflectance");
}

/// A diffuse base below a coat; without the coat where its colour is black.
void coated(Rewrite& w, double kd, bool has_coat) {
  *w.type = has_coat ? "coateddiffuse" : "diffuse";
  w.edit.rename("Kd", "reflectance");
  w.edit.set_default("reflectance", ParamType::kRgb, {kd, kd, kd});
  w.edit.remove({"Ks"});
  if (!has_coat) w.edit.remove({"roughness", "uroughness", "vroughness", "eta", "remaproughness"});
  if (has_coat && !w.edit.has("uroughness") && !w.edit.has("vroughness"))
    w.edit.set_default("roughness", ParamType::kFloat, {0.1});
}

void plastic(Rewrite& w) { coated(w, 0.25, !w.is("Ks", 0)); }

void substrate(Rewrite& w) {
  w.edit.rename("index", "eta");
  coated(w, 0.5, true);
}

void uber(Rewrite& w) {
  w.edit.rename("index", "eta");
  // As far as one of pbrt-v4's materials goes: glass, or a coat that is smooth where only "Kr" reflects.
  const bool clear = w.any("Kt") && w.is("Kd", 0);
  if (clear) {
    *w.type = "dielectric";
    w.edit.remove({"Kd", "Ks", "Kr", "Kt", "roughness", "uroughness", "vroughness"});
    return;
  }
  const bool smooth = w.is("Ks", 0) && w.any("Kr");
  const bool has_coat = !w.is("Ks", 0) || smooth;
  if (smooth) {
    w.edit.set("roughness", ParamType::kFloat, {0});
    w.edit.remove({"Kr", "uroughness", "vroughness"});
  }
  w.drop("Kr", 0);
  w.drop("Kt", 0);
  coated(w, 0.25, has_coat);
}

void metal(Rewrite& w) {
  *w.type = "conductor";
  w.drop("Kr", 1);
  if (!w.edit.has("uroughness") && !w.edit.has("vroughness"))
    w.edit.set_default("roughness", ParamType::kFloat, {0.01});
}

/// pbrt-v2's.
void shiny_metal(Rewrite& w) {
  *w.type = "conductor";
  w.edit.rename("Ks", "reflectance");
  w.edit.rename("Kr", "reflectance");
  w.edit.set_default("reflectance", ParamType::kRgb, {1, 1, 1});
  w.edit.set_default("roughness", ParamType::kFloat, {0.1});
  w.edit.remove({"Ks", "Kr"});
}

void mirror(Rewrite& w) {
  *w.type = "conductor";
  if (w.edit.has("Kr")) {
    w.edit.rename("Kr", "reflectance");
  } else {  // --upgrade makes it silver
    w.edit.set_words("eta", ParamType::kSpectrum, {"metal-Ag-eta"});
    w.edit.set_words("k", ParamType::kSpectrum, {"metal-Ag-k"});
  }
  w.edit.set("roughness", ParamType::kFloat, {0});
}

void glass(Rewrite& w) {
  *w.type = "dielectric";
  w.edit.rename("index", "eta");
  w.drop("Kr", 1);
  w.drop("Kt", 1);
}

void translucent(Rewrite& w) {
  *w.type = "diffusetransmission";
  w.edit.remove({"Ks", "roughness", "remaproughness"});
  const auto share = [&](const char* name) {
    const Parameter* const p = w.edit.find(name);
    if (p == nullptr) return 0.5;
    const auto grey = grey_value(*p);
    if (!grey) w.warn("has a coloured " + in_quotes(name) + ", which is taken as 0.5");
    return grey.value_or(0.5);
  };
  const double reflect = share("reflect"), transmit = share("transmit");
  w.edit.remove({"reflect", "transmit"});
  w.edit.set_default("Kd", ParamType::kRgb, {.25, .25, .25});
  const Parameter kd = *w.edit.find("Kd");
  w.edit.remove({"Kd"});
  if (kd.type == ParamType::kRgb && kd.numbers.size() == 3) {
    const auto times = [&](double s) {
      return std::vector<double>{kd.numbers[0] * s, kd.numbers[1] * s, kd.numbers[2] * s};
    };
    w.edit.set("reflectance", ParamType::kRgb, times(reflect));
    w.edit.set("transmittance", ParamType::kRgb, times(transmit));
    return;
  }
  // Of a texture both have one factor.
  if (reflect != transmit && reflect > 0 && transmit > 0)
    w.warn("of a texture reflects as much as it lets through: \"reflect\" and \"transmit\" are averaged");
  const bool both = reflect > 0 && transmit > 0;
  w.edit.set("scale", ParamType::kFloat, {both ? (reflect + transmit) / 2 : reflect + transmit});
  for (const char* name : {"reflectance", "transmittance"}) {
    if ((name[0] == 'r' ? reflect : transmit) > 0) {
      Parameter& p = w.parameters->emplace_back(kd);
      p.name = name;
    } else {
      w.edit.set(name, ParamType::kRgb, {0, 0, 0});
    }
  }
}

void subsurface(Rewrite& w) {
  *w.type = "subsurface";
  w.edit.rename("Kd", "reflectance");
  w.edit.rename("index", "eta");
  if (w.old_type == "kdsubsurface") {
    w.edit.set_default("reflectance", ParamType::kRgb, {.5, .5, .5});
    w.edit.set_default("eta", ParamType::kFloat, {1.3});
  }
  w.drop("Kr", 1);
  w.drop("Kt", 1);
}

void mix(Rewrite& w) {
  const std::string first = w.edit.text("namedmaterial1", ""), second = w.edit.text("namedmaterial2", "");
  if (first.empty() && second.empty()) return;  // v4's
  if (const Parameter* amount = w.edit.find("amount");
      amount != nullptr && amount->type == ParamType::kRgb && amount->numbers.size() == 3) {
    const std::vector<double>& c = amount->numbers;
    if (!grey_value(*amount)) w.warn("has a coloured \"amount\", of which the mean is taken");
    w.edit.set("amount", ParamType::kFloat, {(c[0] + c[1] + c[2]) / 3});
  }
  // v3's amount is of the first material, v4's of the second.
  w.edit.set_words("materials", ParamType::kString, {second, first});
  w.edit.remove({"namedmaterial1", "namedmaterial2"});
}

void hair(Rewrite& w) { w.edit.rename("color", "reflectance"); }

void fourier(Rewrite& w) {
  *w.type = "diffuse";
  w.problems->unsupported(w.where,
                          "material \"fourier\" of pbrt-v3 is rendered grey; pbrt-v4 has \"measured\" in its "
                          "place, and no tool converts the one to the other");
  w.edit.remove({"bsdffile"});
}

void disney(Rewrite&) {}

using Upgrade = void (*)(Rewrite&);
struct Old {
  Upgrade upgrade;
  bool is_v3_only;
};
const std::map<std::string_view, Old>& table() {
  static const std::map<std::string_view, Old> upgrades = {
      {"disney", {disney, true}},
      {"fourier", {fourier, true}},
      {"glass", {glass, true}},
      {"hair", {hair, false}},
      {"kdsubsurface", {subsurface, true}},
      {"matte", {matte, true}},
      {"metal", {metal, true}},
      {"mirror", {mirror, true}},
      {"mix", {mix, false}},
      {"plastic", {plastic, true}},
      {"shinymetal", {shiny_metal, true}},
      {"substrate", {substrate, true}},
      {"subsurface", {subsurface, false}},
      {"translucent", {translucent, true}},
      {"uber", {uber, true}},
  };
  return upgrades;
}

}  // namespace

bool is_material(const std::string& type) {
  const auto found = table().find(type);
  return found != table().end() && found->second.is_v3_only;
}

void upgrade_material(const SourceLocation& where, std::string* type, std::vector<Parameter>* parameters,
                      ProblemList* problems) {
  Rewrite w{where, type, parameters, problems};
  w.edit.rename("bumpmap", "displacement");
  if (const auto found = table().find(*type); found != table().end()) found->second.upgrade(w);
}

std::optional<FloatInput> read_opacity(PbrtScene& out, ParameterList& params) {
  if (!params.has("opacity")) return std::nullopt;
  const Parameter* const p =
      params.find("opacity", {ParamType::kRgb, ParamType::kFloat, ParamType::kSpectrum, ParamType::kTexture});
  if (p == nullptr) return std::nullopt;
  if (p->type == ParamType::kTexture && p->strings.size() == 1) {
    const int texture = out.float_copy(p->strings[0]);
    if (texture >= 0) return FloatInput{1, texture};
    params.unsupported("opacity", "by a texture that is no image is left out");
    return std::nullopt;
  }
  const Rgb c = p->type == ParamType::kFloat
                    ? Rgb{static_cast<float>(p->numbers[0]), static_cast<float>(p->numbers[0]),
                          static_cast<float>(p->numbers[0])}
                    : out.spectrum(params, "opacity", SpectrumUse::kReflectance, {1, 1, 1});
  if (c.r != c.g || c.g != c.b) params.odd_value("opacity", "is a colour; its mean is taken");
  return FloatInput{std::clamp((c.r + c.g + c.b) / 3, 0.0f, 1.0f), -1};
}

}  // namespace lightmill::v3
