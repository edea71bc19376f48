#include "common/image/view_transform.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/base/error.h"
#include "common/image/color_config.h"
#include "common/image/image.h"

namespace lightmill {

namespace {

/// Curves are flat long before this; it keeps infinity out of their quotients.
constexpr double kBrightest = 1e9;

double hable(double x) {
  constexpr double a = 0.15, b = 0.50, c = 0.10, d = 0.20, e = 0.02, f = 0.30;
  return (x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f) - e / f;
}

double narkowicz(double x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); }

}  // namespace

std::optional<ViewCurve> find_view_curve(const std::string& name) {
  if (name == "srgb") return ViewCurve::kSrgb;
  if (name == "filmic") return ViewCurve::kFilmic;
  if (name == "aces") return ViewCurve::kAces;
  if (name == "none") return ViewCurve::kNone;
  return std::nullopt;
}

ViewCurve view_curve_named(const std::string& name) {
  if (const auto curve = find_view_curve(name)) return *curve;
  throw Error(ErrorKind::kUsage, "no view \"" + name + "\"; use srgb, filmic, aces or none");
}

float view_value(float linear, const ViewTransform& view) {
  if (!(linear > 0)) return 0;
  const double x = std::min(double{linear} * std::exp2(view.exposure), kBrightest);
  switch (view.curve) {
    case ViewCurve::kFilmic:
      return linear_to_srgb(static_cast<float>(hable(2 * x) / hable(11.2)));
    case ViewCurve::kAces:
      return linear_to_srgb(static_cast<float>(narkowicz(0.6 * x)));
    case ViewCurve::kNone:
      return static_cast<float>(std::min(x, 1.0));
    case ViewCurve::kSrgb:
      break;
  }
  return linear_to_srgb(static_cast<float>(x));
}

void view_pixels(const float* linear, size_t pixels, int channels, const ViewTransform& view, float* out) {
  const size_t values = pixels * static_cast<size_t>(channels);
  if (!view.of_config) {
    for (size_t i = 0; i < values; ++i) out[i] = view_value(linear[i], view);
    return;
  }
  if (channels != 3) throw std::logic_error("view_pixels: a configuration's views are of RGB");
  const double scale = std::exp2(view.exposure);
  for (size_t i = 0; i < values; ++i) {
    const double x = double{linear[i]} * scale;
    out[i] = std::isnan(x) ? 0 : static_cast<float>(std::clamp(x, -kBrightest, kBrightest));
  }
  view.of_config->apply(out, pixels);
  for (size_t i = 0; i < values; ++i) out[i] = std::isnan(out[i]) ? 0 : std::clamp(out[i], 0.0f, 1.0f);
}

}  // namespace lightmill
