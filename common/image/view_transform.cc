#include "common/image/view_transform.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "common/image/image.h"

namespace lightmill {

namespace {

double hable(double x) {
  constexpr double a = 0.15, b = 0.50, c = 0.10, d = 0.20, e = 0.02, f = 0.30;
  return (x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f) - e / f;
}

double narkowicz(double x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); }

}  // namespace

ViewCurve view_curve_named(const std::string& name) {
  if (name == "srgb") return ViewCurve::kSrgb;
  if (name == "filmic") return ViewCurve::kFilmic;
  if (name == "aces") return ViewCurve::kAces;
  if (name == "none") return ViewCurve::kNone;
  throw Error(ErrorKind::kUsage, "no view \"" + name + "\"; use srgb, filmic, aces or none");
}

float view_value(float linear, const ViewTransform& view) {
  if (!(linear > 0)) return 0;
  // Curves are flat long before this; it keeps infinity out of their quotients.
  const double x = std::min(double{linear} * std::exp2(view.exposure), 1e9);
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

}  // namespace lightmill
