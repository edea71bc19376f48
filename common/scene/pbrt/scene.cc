#include "common/scene/pbrt/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <utility>

#include "common/base/parse_number.h"
#include "common/scene/spectrum/spectrum.h"

namespace lightmill {

int PbrtScene::material_named(const std::string& name, const SourceLocation& where) {
  Named& entry = named_materials_[name];
  if (entry.index < 0) {
    entry.index = add_material({name, DiffuseMaterial{}, where});
    entry.first_use = where;
  }
  return entry.index;
}

int PbrtScene::texture_named(const std::string& name, bool is_spectrum, const SourceLocation& where) {
  Named& entry = named_textures_[{is_spectrum, name}];
  if (entry.index < 0) {
    entry.index = static_cast<int>(scene.textures.size());
    scene.textures.push_back({name, is_spectrum, ConstantTexture{}, where});
    entry.first_use = where;
  }
  return entry.index;
}

void PbrtScene::warn_of_redefinition(const SourceLocation& where, const char* what, const std::string& name) {
  if (dialect == Dialect::kV3) return;  // where this is how it is done
  problems->warning(where, std::string("the ") + what + " " + in_quotes(name) +
                               " is defined twice; each definition holds until the next");
}

void PbrtScene::define_material(MaterialDescription material) {
  const int index = material_named(material.name, material.location);
  Named& entry = named_materials_[material.name];
  if (std::exchange(entry.defined, true)) {
    warn_of_redefinition(material.location, "material", material.name);
    entry.index = add_material(std::move(material));
    return;
  }
  scene.materials[static_cast<size_t>(index)] = std::move(material);
}

int PbrtScene::medium_named(const std::string& name, const SourceLocation& where) {
  if (name.empty()) return -1;
  Named& entry = named_media_[name];
  if (entry.index < 0) {
    entry.index = static_cast<int>(scene.media.size());
    scene.media.push_back({name, {}, {}, {}, 0, where});
    entry.first_use = where;
  }
  return entry.index;
}

void PbrtScene::define_medium(MediumDescription medium) {
  const int index = medium_named(medium.name, medium.location);
  Named& entry = named_media_[medium.name];
  if (std::exchange(entry.defined, true)) {
    warn_of_redefinition(medium.location, "medium", medium.name);
    entry.index = static_cast<int>(scene.media.size());
    scene.media.push_back(std::move(medium));
    return;
  }
  scene.media[static_cast<size_t>(index)] = std::move(medium);
}

void PbrtScene::define_texture(TextureDescription texture) {
  const int index = texture_named(texture.name, texture.is_spectrum, texture.location);
  Named& entry = named_textures_[{texture.is_spectrum, texture.name}];
  if (std::exchange(entry.defined, true)) {
    warn_of_redefinition(texture.location, "texture", texture.name);
    entry.index = static_cast<int>(scene.textures.size());
    scene.textures.push_back(std::move(texture));
    return;
  }
  scene.textures[static_cast<size_t>(index)] = std::move(texture);
}

bool PbrtScene::material_defined(const std::string& name) const {
  const auto found = named_materials_.find(name);
  return found != named_materials_.end() && found->second.defined;
}

bool PbrtScene::texture_defined(const std::string& name, bool is_spectrum) const {
  const auto found = named_textures_.find({is_spectrum, name});
  return found != named_textures_.end() && found->second.defined;
}

int PbrtScene::add_material(MaterialDescription material) {
  scene.materials.push_back(std::move(material));
  return static_cast<int>(scene.materials.size()) - 1;
}

int PbrtScene::default_material(const SourceLocation& where) {
  if (default_material_ < 0) default_material_ = add_material({"", DiffuseMaterial{}, where});
  return default_material_;
}

bool PbrtScene::may_generate(size_t triangles, ParameterList& params) {
  const bool before = generated_triangles_ <= most_generated_;
  generated_triangles_ += triangles;
  if (generated_triangles_ <= most_generated_) return true;
  if (before) {
    problems->error(params.where(),
                    params.owner() + " makes the triangles of all tessellated shapes more than " +
                        std::to_string(most_generated_) + "; leave out some or use coarser ones");
  }
  return false;
}

void PbrtScene::report_undefined() {
  std::vector<std::string_view> names;
  const auto report = [&](const std::map<std::string, Named>& table, const char* what, const char* instead) {
    names.clear();
    for (const auto& [name, entry] : table) {
      if (entry.defined) names.push_back(name);
    }
    for (const auto& [name, entry] : table) {
      if (!entry.defined) {
        problems->warning(entry.first_use, std::string("there is no ") + what + " named " + in_quotes(name) +
                                               nearest_hint(name, names, "") + instead + " is taken");
      }
    }
  };
  report(named_materials_, "material", "grey");
  report(named_media_, "medium", "empty space");
  if (const int cycle = mix_in_a_cycle(scene.materials); cycle >= 0) {
    const MaterialDescription& m = scene.materials[static_cast<size_t>(cycle)];
    problems->error(m.location, "the mix " + in_quotes(m.name) +
                                    " contains itself; name other materials in one of the mixes around it");
  }
  for (const auto& [key, entry] : named_textures_) {
    if (entry.defined) continue;
    names.clear();
    for (const auto& [other, other_entry] : named_textures_) {
      if (other_entry.defined && other.first == key.first) names.push_back(other.second);
    }
    problems->warning(entry.first_use, std::string("there is no ") + (key.first ? "spectrum" : "float") +
                                           " texture named " + in_quotes(key.second) +
                                           nearest_hint(key.second, names, "the constant 1 is taken"));
  }
}

namespace {

Rgb reduce(const SampledSpectrum& spectrum, SpectrumUse use) {
  return use == SpectrumUse::kEmission ? emitter_to_rgb(spectrum) : factor_to_rgb(spectrum);
}

/// Wavelength-value pairs; reports and returns nothing on an odd count or wavelengths that don't increase. Of
/// a `factor`, values above 1 are cut, with a warning: measured reflectances have some.
std::optional<SampledSpectrum> from_pairs(const std::vector<double>& pairs, ParameterList& params,
                                          const std::string& name, bool factor) {
  if (pairs.size() < 2 || pairs.size() % 2 != 0) {
    params.odd_value(name, "needs pairs of wavelength and value; it is left out");
    return std::nullopt;
  }
  SampledSpectrum s;
  for (size_t i = 0; i < pairs.size(); i += 2) {
    if (pairs[i] <= 0 || (i > 0 && pairs[i] <= pairs[i - 2])) {
      params.odd_value(name, "needs wavelengths in nm that increase; it is left out");
      return std::nullopt;
    }
    if (pairs[i + 1] < 0) params.odd_value(name, "needs values >= 0; 0 is taken");
    s.wavelengths.push_back(pairs[i]);
    s.values.push_back(std::max(pairs[i + 1], 0.0));
  }
  const double largest = *std::max_element(s.values.begin(), s.values.end());
  if (factor && largest > 1) {
    for (double& v : s.values) v = std::min(v, 1.0);
    params.problems().warning(params.where_of(name), "parameter " + in_quotes(name) + " of " +
                                                         params.owner() + " has values up to " +
                                                         std::to_string(largest) +
                                                         "; a reflectance is at most 1, which is taken");
  }
  return s;
}

}  // namespace

std::vector<double> read_number_file(const std::string& path) {
  constexpr size_t kMaxNumbers = 1 << 20;
  std::ifstream in(path);
  std::vector<double> numbers;
  std::string word;
  while (in >> word) {
    if (word[0] == '#') {
      std::getline(in, word);
      continue;
    }
    double value = 0;
    if (word.size() > 100 || !parse_number(word, &value) || numbers.size() >= kMaxNumbers) return {};
    numbers.push_back(value);
  }
  return numbers;
}

Rgb PbrtScene::read_spectrum(const Parameter& p, SpectrumUse use, ParameterList& params, Rgb fallback) {
  const bool reflectance = use == SpectrumUse::kReflectance;
  if (p.type == ParamType::kRgb) {
    if (p.numbers.size() != 3) {
      params.odd_value(p.name,
                       "has " + std::to_string(p.numbers.size()) + " numbers; rgb needs 3; it is left out");
      return fallback;
    }
    std::array<double, 3> c{p.numbers[0], p.numbers[1], p.numbers[2]};
    const auto [low, high] = std::minmax_element(c.begin(), c.end());
    if (*low < 0 || (reflectance && *high > 1)) {
      params.odd_value(p.name, std::string(reflectance ? "must be within [0, 1]" : "must not be negative") +
                                   "; it is cut to that");
      for (double& x : c) x = std::clamp(x, 0.0, reflectance ? 1.0 : kAnySize);
    }
    const auto rgb = to_rec709(p.color_space, c, use == SpectrumUse::kEmission);
    // Colours outside Rec.709 go to its border.
    const auto within = [&](double x) {
      return static_cast<float>(std::max(0.0, reflectance ? std::min(x, 1.0) : x));
    };
    return {within(rgb[0]), within(rgb[1]), within(rgb[2])};
  }
  if (p.type == ParamType::kBlackbody) {
    const double kelvin = std::clamp(p.numbers.empty() ? 6500 : p.numbers[0], 200.0, 1e6);
    if (p.numbers.size() != 1 || p.numbers[0] != kelvin) {
      params.odd_value(p.name, "needs one temperature from 200 to 1000000 kelvin; " + std::to_string(kelvin) +
                                   " is taken");
    }
    const Rgb c = blackbody_to_rgb(kelvin);
    if (use == SpectrumUse::kEmission) return c;
    const float peak = std::max({c.r, c.g, c.b});  // as a factor: a tint whose largest component is 1
    return {c.r / peak, c.g / peak, c.b / peak};
  }
  std::optional<SampledSpectrum> sampled;
  if (p.strings.empty()) {
    sampled = from_pairs(p.numbers, params, p.name, reflectance);
  } else if (p.strings.size() == 1 && p.numbers.empty()) {
    const std::string& name = p.strings[0];
    if (use == SpectrumUse::kEmission) {
      if (const auto light = named_illuminant(name)) return *light;
    } else {
      if (const auto metal = named_metal(name)) return *metal;
      if (const auto glass = named_glass(name)) return {*glass, *glass, *glass};
    }
    if (name.find('.') == std::string::npos && name.find('/') == std::string::npos) {
      params.odd_value(p.name, "names no spectrum of that use: " + in_quotes(name) +
                                   nearest_hint(name, spectrum_names(), "it is left out"));
      return fallback;
    }
    const std::string path = open_reference(name, p.where);
    if (path.empty()) return fallback;
    sampled = from_pairs(read_number_file(path), params, p.name, reflectance);
  } else {
    params.odd_value(p.name, "needs one name or pairs of wavelength and value; it is left out");
  }
  return sampled ? reduce(*sampled, use) : fallback;
}

Rgb PbrtScene::spectrum(ParameterList& params, std::string_view name, SpectrumUse use, Rgb fallback) {
  const Parameter* p = params.find(name, {ParamType::kRgb, ParamType::kSpectrum, ParamType::kBlackbody});
  return p == nullptr ? fallback : read_spectrum(*p, use, params, fallback);
}

SpectrumInput PbrtScene::spectrum_input(ParameterList& params, std::string_view name, SpectrumUse use,
                                        Rgb fallback) {
  const Parameter* p =
      params.find(name, {ParamType::kRgb, ParamType::kSpectrum, ParamType::kBlackbody, ParamType::kTexture});
  if (p == nullptr) return {fallback, -1};
  if (p->type != ParamType::kTexture) return {read_spectrum(*p, use, params, fallback), -1};
  return {fallback, texture_given(params, name, *p, true).value_or(-1)};
}

FloatInput PbrtScene::float_input(ParameterList& params, std::string_view name, float fallback, double min,
                                  double max) {
  const Parameter* p = params.find(name, {ParamType::kFloat, ParamType::kTexture});
  if (p == nullptr) return {fallback, -1};
  if (p->type == ParamType::kFloat) return {static_cast<float>(params.number(name, fallback, min, max)), -1};
  return {fallback, texture_given(params, name, *p, false).value_or(-1)};
}

void report_unknown_word(ParameterList& params, const std::string& kind, const std::string& word,
                         const std::vector<std::string_view>& known, const std::string& consequence) {
  params.problems().warning(params.where(), "unknown " + kind + " " + in_quotes(word) +
                                                nearest_hint(word, known, "") + consequence);
}

}  // namespace lightmill
