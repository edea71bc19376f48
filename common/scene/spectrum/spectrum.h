#pragma once
// Spectra reduced to linear Rec.709 RGB. Colour matching: the multi-lobe fit of Wyman, Sloan, Shirley,
// "Simple Analytic Approximations to the CIE XYZ Color Matching Functions" (JCGT 2013), eq. 4.
#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

/// Piecewise linear over wavelength: `wavelengths` in nm, strictly increasing; same length; constant
/// beyond the ends.
struct SampledSpectrum {
  std::vector<double> wavelengths;
  std::vector<double> values;
};

/// Colour of a reflectance, an index of refraction or another factor, averaged under D65: a constant c
/// gives exactly (c, c, c). Never negative.
Rgb factor_to_rgb(const SampledSpectrum& spectrum);
/// What the same averaging makes of a value of 1 at one of the (strictly increasing) wavelengths and 0 at the
/// others: RGB of a spectrum is the sum of its values times these.
std::vector<std::array<double, 3>> factor_weights(const std::vector<double>& wavelengths);
/// Colour of an emitter, scaled to luminance 1 as pbrt does. Components outside Rec.709 are clamped to 0.
/// (0,0,0) for a spectrum without visible energy.
Rgb emitter_to_rgb(const SampledSpectrum& spectrum);
/// Black body of `kelvin` > 0, scaled to luminance 1.
Rgb blackbody_to_rgb(double kelvin);
/// What pbrt's camera shows of a spectrum that is a black body's, scaled to 1 at its peak: its products with
/// the colour matching functions, integrated over nm. Black below 100 kelvin.
Rgb black_body_radiance(double kelvin);

/// "metal-Cu-eta", "metal-Cu-k", ...: RGB figures.
std::optional<Rgb> named_metal(std::string_view name);
/// "glass-BK7", ...: index of refraction at the sodium D line.
std::optional<float> named_glass(std::string_view name);
/// "stdillum-D65", ...: colour at luminance 1.
std::optional<Rgb> named_illuminant(std::string_view name);
/// All names that the three functions above know.
std::vector<std::string_view> spectrum_names();

/// Y of a linear Rec.709 colour.
inline double luminance(const Rgb& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

}  // namespace lightmill
