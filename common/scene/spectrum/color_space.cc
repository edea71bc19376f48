#include "common/scene/spectrum/color_space.h"

#include "common/base/rgb_primaries.h"

namespace lightmill {
namespace {

/// SMPTE EG 432-1 with the white of displays (D65), as pbrt-v4 has it.
constexpr RgbPrimaries kDciP3{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {0.3127, 0.3290}};

const RgbPrimaries& primaries(ColorSpace space) {
  switch (space) {
    case ColorSpace::kRec2020:
      return kRec2020Primaries;
    case ColorSpace::kAces:
      return kAp0Primaries;
    case ColorSpace::kDciP3:
      return kDciP3;
    case ColorSpace::kSrgb:
      break;
  }
  return kRec709Primaries;
}

}  // namespace

const std::vector<std::string_view>& color_space_names() {
  static const std::vector<std::string_view> names{"srgb", "rec2020", "aces2065-1", "dci-p3"};
  return names;
}

std::optional<ColorSpace> color_space_named(std::string_view name) {
  const auto& names = color_space_names();
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return static_cast<ColorSpace>(i);
  }
  return std::nullopt;
}

std::array<double, 3> to_rec709(ColorSpace space, const std::array<double, 3>& color, bool emission) {
  if (space == ColorSpace::kSrgb) return color;
  const RgbMatrix in = rgb_to_xyz(primaries(space)).value(), out = xyz_to_rgb(kRec709Primaries).value();
  std::array<double, 3> rgb = transformed(out, transformed(in, color));
  if (emission) return rgb;
  // A surface adapts: what is white there is white here, component by component.
  const std::array<double, 3> white = transformed(out, transformed(in, {1, 1, 1}));
  for (size_t c = 0; c < 3; ++c) rgb[c] /= white[c];
  return rgb;
}

}  // namespace lightmill
