#include "common/scene/texture_graph/color_ramp.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

using Color4 = std::array<float, 4>;

/// Hue in turns, saturation, and value or lightness; alpha stays.
Color4 to_hues(const Color4& c, bool lightness) {
  const float high = std::max({c[0], c[1], c[2]}), low = std::min({c[0], c[1], c[2]}), spread = high - low;
  float hue = 0;
  if (spread > 0) {
    if (high == c[0]) {
      hue = (c[1] - c[2]) / spread;
    } else {
      hue = high == c[1] ? 2 + (c[2] - c[0]) / spread : 4 + (c[0] - c[1]) / spread;
    }
    hue /= 6;
    if (hue < 0) hue += 1;
  }
  if (!lightness) return {hue, high > 0 ? spread / high : 0, high, c[3]};
  const float l = 0.5f * (high + low);
  const float s = spread > 0 ? spread / (l > 0.5f ? 2 - high - low : high + low) : 0;
  return {hue, s, l, c[3]};
}

Color4 from_hues(const Color4& h, bool lightness) {
  const auto pure = [&](float shift) {
    return std::clamp(std::fabs(h[0] * 6 - shift) * (shift == 3 ? 1.0f : -1.0f) + (shift == 3 ? -1.0f : 2.0f),
                      0.0f, 1.0f);
  };
  const Color4 full{pure(3), pure(2), pure(4), h[3]};
  Color4 out = full;
  const float chroma = (1 - std::fabs(2 * h[2] - 1)) * h[1];
  for (size_t i = 0; i < 3; ++i)
    out[i] = lightness ? (full[i] - 0.5f) * chroma + h[2] : ((full[i] - 1) * h[1] + 1) * h[2];
  return out;
}

/// From `a` to `b`, both in turns.
float between_hues(HueInterpolation way, float t, float a, float b) {
  const bool far = std::fabs(a - b) > 0.5f;
  bool lift_a = false, lift_b = false;
  switch (way) {
    case HueInterpolation::kNear:
      lift_a = a < b && far, lift_b = a > b && far;
      break;
    case HueInterpolation::kFar:
      lift_a = a <= b && !far, lift_b = a > b && !far;
      break;
    case HueInterpolation::kClockwise:
      lift_b = a > b;
      break;
    case HueInterpolation::kCounterClockwise:
      lift_a = a < b;
      break;
  }
  if (lift_a) a += 1;
  if (lift_b) b += 1;
  const float hue = (1 - t) * a + t * b;
  return hue - std::floor(hue);
}

Color4 mixed(const ColorRamp& ramp, const Color4& a, const Color4& b, float t) {
  Color4 out{};
  if (ramp.mode == RampMode::kRgb) {
    for (size_t i = 0; i < 4; ++i) out[i] = (1 - t) * a[i] + t * b[i];
    return out;
  }
  const bool lightness = ramp.mode == RampMode::kHsl;
  const Color4 x = to_hues(a, lightness), y = to_hues(b, lightness);
  for (size_t i = 1; i < 4; ++i) out[i] = (1 - t) * x[i] + t * y[i];
  out[0] = between_hues(ramp.hue, t, x[0], y[0]);
  return from_hues(out, lightness);
}

/// Weights of four stops in a row for a place t between the second and the third.
std::array<float, 4> spline_weights(bool cardinal, float t) {
  const float t2 = t * t, t3 = t2 * t;
  if (!cardinal) {
    return {-t3 / 6 + t2 / 2 - t / 2 + 1.0f / 6, t3 / 2 - t2 + 2.0f / 3, -t3 / 2 + t2 / 2 + t / 2 + 1.0f / 6,
            t3 / 6};
  }
  constexpr float k = 0.71f;  // Blender's tension
  return {-k * t3 + 2 * k * t2 - k * t, (2 - k) * t3 + (k - 3) * t2 + 1,
          (k - 2) * t3 + (3 - 2 * k) * t2 + k * t, k * t3 - k * t2};
}

}  // namespace

std::array<float, 4> ramp_color(const ColorRamp& ramp, float x) {
  const std::vector<ColorRamp::Stop>& stops = ramp.stops;
  if (stops.size() == 1) return stops[0].color;
  const bool spline = ramp.mode == RampMode::kRgb && (ramp.interpolation == RampInterpolation::kBSpline ||
                                                      ramp.interpolation == RampInterpolation::kCardinal);
  if (!spline && x <= stops.front().position) return stops.front().color;
  const size_t next = static_cast<size_t>(
      std::find_if(stops.begin(), stops.end(), [&](const auto& s) { return s.position > x; }) -
      stops.begin());
  const size_t last = stops.size() - 1;
  if (!spline && next > last) return stops.back().color;
  // The ramp goes on to 0 and to 1 with the colours of its ends.
  const ColorRamp::Stop right = next > last ? ColorRamp::Stop{1, stops[last].color} : stops[next];
  const ColorRamp::Stop left = next == 0 ? ColorRamp::Stop{0, stops[0].color} : stops[next - 1];
  if (ramp.interpolation == RampInterpolation::kConstant) return left.color;
  const float width = right.position - left.position;
  float t = width > 0 ? (x - left.position) / width : next > last ? 0.0f : 1.0f;
  if (spline) {
    const Color4 &after = next >= last ? right.color : stops[next + 1].color,
                 &before = next < 2 ? left.color : stops[next - 2].color;
    const auto w =
        spline_weights(ramp.interpolation == RampInterpolation::kCardinal, 1 - std::clamp(t, 0.0f, 1.0f));
    Color4 out{};
    for (size_t i = 0; i < 4; ++i) {
      out[i] = std::clamp(w[3] * before[i] + w[2] * left.color[i] + w[1] * right.color[i] + w[0] * after[i],
                          0.0f, 1.0f);
    }
    return out;
  }
  if (ramp.interpolation == RampInterpolation::kEase) t = t * t * (3 - 2 * t);
  return mixed(ramp, left.color, right.color, t);
}

}  // namespace lightmill
