#include "common/scene/spectrum/spectrum.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lightmill {
namespace {

constexpr double kFirst = 380, kLast = 780, kStep = 2;  // nm; the integration grid
constexpr int kSteps = static_cast<int>((kLast - kFirst) / kStep) + 1;

using Triple = std::array<double, 3>;

/// Gaussian lobe with different widths left and right of its mean (nm).
double lobe(double x, double mean, double left, double right) {
  const double t = (x - mean) / (x < mean ? left : right);
  return std::exp(-0.5 * t * t);
}

Triple matching_functions(double nm) {
  return {1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) -
              0.065 * lobe(nm, 501.1, 20.4, 26.2),
          0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1),
          1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8)};
}

/// CIE standard illuminant D65, relative, every 10 nm from 380 (CIE 15:2004, table T.1).
constexpr double kD65[] = {49.98,  54.65,  82.75,  91.49,  93.43,  86.68,  104.86, 117.01, 117.81,
                           114.86, 115.92, 108.81, 109.35, 107.80, 104.79, 107.69, 104.41, 104.05,
                           100.00, 96.33,  95.79,  88.69,  90.01,  89.60,  87.70,  83.29,  83.70,
                           80.03,  80.21,  82.28,  78.28,  69.72,  71.61,  74.35,  61.60,  69.89,
                           75.09,  63.59,  46.42,  66.81,  63.38};

double d65(double nm) {
  const double at = std::clamp((nm - 380) / 10, 0.0, static_cast<double>(std::size(kD65) - 1));
  const auto i = std::min(static_cast<size_t>(at), std::size(kD65) - 2);
  const double t = at - static_cast<double>(i);
  return kD65[i] * (1 - t) + kD65[i + 1] * t;
}

/// The samples around a wavelength: t of `above`, the rest of `below`.
struct Between {
  size_t below, above;
  double t;
};
Between between(const std::vector<double>& wavelengths, double nm) {
  const size_t last = wavelengths.size() - 1;
  if (nm <= wavelengths.front()) return {0, 0, 0};
  if (nm >= wavelengths.back()) return {last, last, 0};
  const auto above =
      static_cast<size_t>(std::upper_bound(wavelengths.begin(), wavelengths.end(), nm) - wavelengths.begin());
  return {above - 1, above, (nm - wavelengths[above - 1]) / (wavelengths[above] - wavelengths[above - 1])};
}

double value_at(const SampledSpectrum& s, double nm) {
  const Between at = between(s.wavelengths, nm);
  return s.values[at.below] * (1 - at.t) + s.values[at.above] * at.t;
}

/// XYZ to linear Rec.709 (IEC 61966-2-1).
Triple xyz_to_rgb(const Triple& c) {
  return {3.2404542 * c[0] - 1.5371385 * c[1] - 0.4985314 * c[2],
          -0.9692660 * c[0] + 1.8760108 * c[1] + 0.0415560 * c[2],
          0.0556434 * c[0] - 0.2040259 * c[1] + 1.0572252 * c[2]};
}

template <class F>
Triple integrate_xyz(const F& power) {
  Triple sum{};
  for (int step = 0; step < kSteps; ++step) {
    const double nm = kFirst + step * kStep;
    const Triple cmf = matching_functions(nm);
    const double p = power(nm) * kStep;
    for (size_t i = 0; i < 3; ++i) sum[i] += cmf[i] * p;
  }
  return sum;
}

Rgb non_negative(const Triple& c) {
  const auto f = [](double x) { return static_cast<float>(std::max(x, 0.0)); };
  return {f(c[0]), f(c[1]), f(c[2])};
}

Rgb unit_luminance(const Triple& xyz) {
  if (!(xyz[1] > 0) || !std::isfinite(xyz[1])) return {};
  return non_negative(xyz_to_rgb({xyz[0] / xyz[1], 1, xyz[2] / xyz[1]}));
}

struct NamedRgb {
  std::string_view name;
  Rgb value;
};
// Real parts are the metals' measured n averaged to Rec.709. The imaginary ones are chosen so that the
// reflectance at normal incidence is the colour which the measured spectra give under D65 (k averaged itself
// would make gold 5 % too dark a red): Ag .972 .960 .915, Al .913 .922 .925, Au .990 .783 .343, Cu .955 .638
// .538, CuZn .910 .778 .423. Gold's red would be 1.02, outside Rec.709.
constexpr NamedRgb kMetals[] = {
    {"metal-Ag-eta", {0.155265f, 0.116723f, 0.138381f}}, {"metal-Ag-k", {4.5229f, 3.2243f, 2.2889f}},
    {"metal-Al-eta", {1.657460f, 0.880369f, 0.521229f}}, {"metal-Al-k", {8.3258f, 6.4284f, 5.0300f}},
    {"metal-Au-eta", {0.143119f, 0.374957f, 1.442479f}}, {"metal-Au-k", {7.4794f, 2.2372f, 1.6798f}},
    {"metal-Cu-eta", {0.200438f, 0.924033f, 1.102212f}}, {"metal-Cu-k", {4.0614f, 2.5489f, 2.2645f}},
    {"metal-CuZn-eta", {0.444f, 0.527f, 1.094f}},        {"metal-CuZn-k", {4.1906f, 2.6789f, 1.7879f}},
    {"metal-MgO-eta", {1.7342f, 1.7402f, 1.7514f}},      {"metal-MgO-k", {0, 0, 0}},
    {"metal-TiO2-eta", {2.860f, 2.957f, 3.187f}},        {"metal-TiO2-k", {0, 0, 0}},
};

struct NamedFloat {
  std::string_view name;
  float value;
};
// n_D from the makers' data sheets. pbrt's "glass-F5", "-F10" and "-F11" are SF5, SF10 and SF11.
constexpr NamedFloat kGlasses[] = {
    {"glass-BK7", 1.5168f},  {"glass-BAF10", 1.6700f}, {"glass-FK51A", 1.4866f}, {"glass-LASF9", 1.8503f},
    {"glass-F5", 1.6727f},   {"glass-F10", 1.7283f},   {"glass-F11", 1.7847f},   {"glass-SF5", 1.6727f},
    {"glass-SF10", 1.7283f}, {"glass-SF11", 1.7847f},
};

struct Chromaticity {
  std::string_view name;
  double x, y;
};
// CIE 15:2004, 2 degree observer; ACES white point from SMPTE ST 2065-1.
constexpr Chromaticity kIlluminants[] = {
    {"stdillum-A", 0.44757, 0.40745},   {"stdillum-D50", 0.34567, 0.35850},
    {"stdillum-D65", 0.31272, 0.32903}, {"stdillum-F1", 0.31310, 0.33710},
    {"stdillum-F2", 0.37210, 0.37510},  {"stdillum-F3", 0.40910, 0.39410},
    {"stdillum-F4", 0.44020, 0.40310},  {"stdillum-F5", 0.31380, 0.34520},
    {"stdillum-F6", 0.37790, 0.38820},  {"stdillum-F7", 0.31290, 0.32920},
    {"stdillum-F8", 0.34580, 0.35860},  {"stdillum-F9", 0.37410, 0.37270},
    {"stdillum-F10", 0.34580, 0.35880}, {"stdillum-F11", 0.38050, 0.37690},
    {"stdillum-F12", 0.43700, 0.40420}, {"illum-acesD60", 0.32168, 0.33767},
};

/// Planck's law: the logarithm of a black body's power at a wavelength, up to a constant. Relative to 560 nm
/// so that nothing leaves double's range.
double log_black_body(double nm, double kelvin) {
  constexpr double kSecondRadiation = 1.438776877e7;  // hc/k in nm K
  const double e = kSecondRadiation / (nm * kelvin);
  return -5 * std::log(nm / 560) - (e > 500 ? e : std::log(std::expm1(e)));
}

}  // namespace

Rgb factor_to_rgb(const SampledSpectrum& spectrum) {
  static const Triple white = xyz_to_rgb(integrate_xyz(d65));
  const Triple c = xyz_to_rgb(integrate_xyz([&](double nm) { return d65(nm) * value_at(spectrum, nm); }));
  const bool constant = std::all_of(spectrum.values.begin(), spectrum.values.end(),
                                    [&](double v) { return v == spectrum.values.front(); });
  if (constant) {
    const double v = spectrum.values.front();
    return non_negative({v, v, v});
  }
  return non_negative({c[0] / white[0], c[1] / white[1], c[2] / white[2]});
}

std::vector<std::array<double, 3>> factor_weights(const std::vector<double>& wavelengths) {
  std::vector<Triple> xyz(wavelengths.size());
  for (int step = 0; step < kSteps; ++step) {
    const double nm = kFirst + step * kStep;
    const Triple cmf = matching_functions(nm);
    const Between at = between(wavelengths, nm);
    for (size_t i = 0; i < 3; ++i) {
      const double power = cmf[i] * d65(nm) * kStep;
      xyz[at.below][i] += power * (1 - at.t);
      xyz[at.above][i] += power * at.t;
    }
  }
  const Triple white = xyz_to_rgb(integrate_xyz(d65));
  for (Triple& w : xyz) {
    w = xyz_to_rgb(w);
    for (size_t i = 0; i < 3; ++i) w[i] /= white[i];
  }
  return xyz;
}

Rgb emitter_to_rgb(const SampledSpectrum& spectrum) {
  return unit_luminance(integrate_xyz([&](double nm) { return value_at(spectrum, nm); }));
}

Rgb blackbody_to_rgb(double kelvin) {
  const double reference = log_black_body(kLast, kelvin);
  return unit_luminance(
      integrate_xyz([&](double nm) { return std::exp(log_black_body(nm, kelvin) - reference); }));
}

Rgb black_body_radiance(double kelvin) {
  if (!(kelvin > 100)) return {};
  constexpr double kWien = 2.897771955e6;  // wavelength of the peak times temperature, nm K
  const double peak = log_black_body(kWien / kelvin, kelvin);
  const Triple c =
      xyz_to_rgb(integrate_xyz([&](double nm) { return std::exp(log_black_body(nm, kelvin) - peak); }));
  return non_negative(c);
}

std::optional<Rgb> named_metal(std::string_view name) {
  for (const NamedRgb& m : kMetals) {
    if (m.name == name) return m.value;
  }
  return std::nullopt;
}

std::optional<float> named_glass(std::string_view name) {
  for (const NamedFloat& g : kGlasses) {
    if (g.name == name) return g.value;
  }
  return std::nullopt;
}

std::optional<Rgb> named_illuminant(std::string_view name) {
  for (const Chromaticity& c : kIlluminants) {
    if (c.name == name) return unit_luminance({c.x / c.y, 1, (1 - c.x - c.y) / c.y});
  }
  return std::nullopt;
}

std::vector<std::string_view> spectrum_names() {
  std::vector<std::string_view> names;
  for (const NamedRgb& m : kMetals) names.push_back(m.name);
  for (const NamedFloat& g : kGlasses) names.push_back(g.name);
  for (const Chromaticity& c : kIlluminants) names.push_back(c.name);
  return names;
}

}  // namespace lightmill
