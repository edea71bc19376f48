#pragma once
// RGB colour spaces of scene files, converted to the renderer's linear Rec.709 (sRGB primaries, D65) at load.
#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

enum class ColorSpace { kSrgb, kRec2020, kAces, kDciP3 };

/// pbrt-v4's names: "srgb", "rec2020", "aces2065-1", "dci-p3".
const std::vector<std::string_view>& color_space_names();
std::optional<ColorSpace> color_space_named(std::string_view name);

/// A linear colour of `space` as linear Rec.709; components may come out negative, and above 1.
///   emission      the light that the numbers stand for: the space's white keeps its own tint (ACES: D60)
///   otherwise     a factor: (c, c, c) stays (c, c, c), whatever the space's white
std::array<double, 3> to_rec709(ColorSpace space, const std::array<double, 3>& color, bool emission);

}  // namespace lightmill
