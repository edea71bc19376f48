#pragma once
// The factors of a light mix as text: what `lightmill mix` and the dashboard both take.
#include <array>
#include <optional>
#include <string_view>

namespace lightmill {

/// What the radiance of a group is multiplied by, for red, green and blue; finite and >= 0. The factor 0
/// leaves the group out, so its pixels may then be NaN or infinite.
using LightFactor = std::array<double, 3>;

inline constexpr double kLargestLightFactor = 1e9;  // so that floats hold what light times it is

/// "1.5" for all three channels, or with `separator` '/' "0.2/0.3/0.4" for red, green and blue. Nothing
/// unless it is one number or three, each from 0 to kLargestLightFactor, and no character more.
std::optional<LightFactor> light_factor_of_text(std::string_view text, char separator);

}  // namespace lightmill
