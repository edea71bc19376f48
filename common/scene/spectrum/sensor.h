#pragma once
// Camera sensors: how the colours that they take down differ from the light's.
#include <array>
#include <optional>
#include <string_view>
#include <vector>

namespace lightmill {

/// Of linear Rec.709, row-major.
using ColorMatrix = std::array<double, 9>;

/// What a sensor makes of colours, balanced for daylight of 6500 K; nullopt for an unknown name. "cie1931"
/// changes nothing. The others are pbrt-v4's, fitted to its renders of 27 reflectances under its white.
std::optional<ColorMatrix> sensor_named(std::string_view name);
std::vector<std::string_view> sensor_names();

/// Lowest temperature that white can be balanced for, in kelvin.
inline constexpr double kLeastWhiteBalance = 1900;
/// Makes what daylight (CIE 15:2004; below 4000 K a black body) of `kelvin` lights neutral: von Kries in
/// Bradford's cone space.
ColorMatrix white_balance(double kelvin);

/// Row-major a b: b is applied first.
ColorMatrix product(const ColorMatrix& a, const ColorMatrix& b);

}  // namespace lightmill
