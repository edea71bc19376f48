// MakeNamedMedium.
#include <algorithm>

#include "common/scene/pbrt/scene.h"
#include "common/scene/spectrum/medium_presets.h"

namespace lightmill {
namespace {

constexpr double kMaxDensityScale = 1e30;
/// Beyond this mean cosine a phase function is a beam that float can hardly tell from no scattering.
constexpr double kMostForward = 0.9999;

Rgb times(const Rgb& c, double s) {
  const auto f = [&](float x) { return static_cast<float>(x * s); };
  return {f(c.r), f(c.g), f(c.b)};
}

bool fits(const Rgb& c) { return std::max({c.r, c.g, c.b}) <= kMaxDensityScale; }

float mean_cosine(ParameterList& params) {
  return static_cast<float>(params.number("g", 0, -kMostForward, kMostForward));
}

/// Coefficients, phase function and emission: what media of all kinds have, "rgbgrid" apart.
void read_coefficients(PbrtScene& out, ParameterList& params, bool varies, MediumDescription* medium) {
  const std::string preset = params.text("preset", "");
  const MeasuredMedium* measured = preset.empty() ? nullptr : find_measured_medium(preset);
  if (!preset.empty() && measured == nullptr) {
    params.odd_value("preset", "names no measured medium, and is left out: " + in_quotes(preset) +
                                   nearest_hint(preset, measured_medium_names()));
  }
  medium->sigma_a = out.spectrum(params, "sigma_a", SpectrumUse::kFactor, {1, 1, 1});
  medium->sigma_s = out.spectrum(params, "sigma_s", SpectrumUse::kFactor, {1, 1, 1});
  if (measured != nullptr) {
    medium->sigma_a = measured->sigma_a;
    medium->sigma_s = measured->reduced_sigma_s;
  }
  const double scale = params.number("scale", 1, 0, kMaxDensityScale);
  medium->sigma_a = times(medium->sigma_a, scale);
  medium->sigma_s = times(medium->sigma_s, scale);
  medium->g = mean_cosine(params);
  medium->emission = out.spectrum(params, "Le", SpectrumUse::kEmission, {0, 0, 0});
  if (!varies) medium->emission = times(medium->emission, params.number("Lescale", 1, 0, kMaxDensityScale));
  if (!fits(medium->sigma_a) || !fits(medium->sigma_s) || !fits(medium->emission))
    out.problems->error(params.where(),
                        params.owner() + " has coefficients beyond 1e30; lower its \"scale\"");
}

}  // namespace

MediumDescription translate_medium(PbrtScene& out, const std::string& name, ParameterList& params,
                                   const Transform& ctm) {
  MediumDescription medium;
  medium.name = name;
  medium.location = params.where();
  medium.light_group = light_group_from(params);
  const std::string type = params.text("type", "");
  if (type == "homogeneous") {
    read_coefficients(out, params, false, &medium);
    params.finish();
    return medium;
  }
  static const std::vector<std::string_view> known = {"homogeneous", "uniformgrid", "rgbgrid",
                                                      "cloud",       "nanovdb",     "vdb"};
  if (std::ranges::find(known, type) != known.end()) {
    if (type != "rgbgrid") {
      read_coefficients(out, params, true, &medium);
    } else {
      medium.g = mean_cosine(params);
    }
    medium.grid = type == "nanovdb" || type == "vdb" ? refer_to_volume_file(out, params, ctm, &medium)
                                                     : read_medium_grid(type, params, ctm, &medium);
    params.finish();
    if (medium.grid == nullptr) medium.sigma_a = medium.sigma_s = {0, 0, 0};
    return medium;
  }
  medium.sigma_a = medium.sigma_s = {0, 0, 0};
  if (type.empty()) {
    if (!params.has("type"))
      out.problems->warning(params.where(), params.owner() + " needs a \"string type\"; it is empty space");
  } else {
    report_unknown_word(params, "medium", type, known, "it is empty space");
  }
  return medium;  // its parameters are another medium's: not checked
}

}  // namespace lightmill
