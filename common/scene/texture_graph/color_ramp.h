#pragma once
// Colour ramps as Blender's ColorRamp node has them, sampled.
#include <array>
#include <vector>

namespace lightmill {

enum class RampInterpolation { kLinear, kEase, kConstant, kCardinal, kBSpline };
enum class RampMode { kRgb, kHsv, kHsl };
enum class HueInterpolation { kNear, kFar, kClockwise, kCounterClockwise };

struct ColorRamp {
  struct Stop {
    float position = 0;
    std::array<float, 4> color{};  // linear RGB and alpha
  };
  std::vector<Stop> stops;  // one at least, by position
  RampInterpolation interpolation = RampInterpolation::kLinear;
  RampMode mode = RampMode::kRgb;
  HueInterpolation hue = HueInterpolation::kNear;
};

std::array<float, 4> ramp_color(const ColorRamp& ramp, float x);

}  // namespace lightmill
