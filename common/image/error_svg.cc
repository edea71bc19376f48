// The plot of a curve: log-log relMSE against wall seconds, the interval as a band, the true error as a
// dashed line where a reference is known, and a guide of slope -1 (error falls as 1/time).
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "common/image/report.h"
#include "common/image/report_text.h"

namespace lightmill {

namespace {

constexpr double kWidth = 760, kHeight = 460;
constexpr double kLeft = 84, kRight = 24, kTop = 44, kBottom = 60;

std::string px(double v) {
  // Hundredths of a pixel are enough and keep the file small.
  return short_number(std::round(v * 100) / 100, 8);
}

/// One logarithmic axis: values [low, high] > 0 onto pixels [at_low, at_high].
struct Axis {
  double low = 1, high = 10, at_low = 0, at_high = 1;
  double map(double v) const {
    const double t = (std::log(std::max(v, 1e-300)) - std::log(low)) / (std::log(high) - std::log(low));
    return at_low + std::clamp(t, 0.0, 1.0) * (at_high - at_low);
  }
};

struct Tick {
  double value = 1;
  bool labelled = false;
};

/// Decades, with 2 and 5 labelled too where there are few decades, and all of 1..9 as minor ticks; at most
/// about a dozen labels.
std::vector<Tick> ticks_of(const Axis& axis) {
  const double decades = std::log10(axis.high / axis.low);
  const int first = static_cast<int>(std::floor(std::log10(axis.low)));
  const int last = static_cast<int>(std::ceil(std::log10(axis.high)));
  const int every = std::max(1, static_cast<int>(std::ceil(decades / 10)));
  std::vector<Tick> ticks;
  for (int e = first; e <= last; ++e) {
    for (int m = 1; m <= 9; ++m) {
      const double v = m * std::pow(10.0, e);
      if (v < axis.low * (1 - 1e-9) || v > axis.high * (1 + 1e-9)) continue;
      if (m > 1 && decades > 6) continue;
      const bool labelled =
          (m == 1 && e % every == 0) || ((m == 2 || m == 5) && decades < 2.2) || (decades < 0.5);
      ticks.push_back({v, labelled});
    }
  }
  return ticks;
}

std::string tick_label(double v) {
  const double e = std::log10(v);
  if (e > -3.5 && e < 4.5) return short_number(v, 3);
  const auto exponent = static_cast<int>(std::floor(e + 1e-9));
  const auto mantissa = static_cast<int>(std::lround(v / std::pow(10.0, exponent)));
  std::string label = mantissa == 1 ? "10" : std::to_string(mantissa) + "·10";
  return label + "<tspan dy=\"-5\" font-size=\"9\">" + std::to_string(exponent) + "</tspan>";
}

/// Widens a range by a factor, at least to a factor of `least` in all.
void set_range(Axis* axis, double low, double high, double least) {
  const double middle = std::sqrt(low) * std::sqrt(high);
  const double half = std::max(std::sqrt(high / low) * 1.15, std::sqrt(least));
  axis->low = middle / half;
  axis->high = middle * half;
}

bool plottable(double v) { return std::isfinite(v) && v > 1e-100 && v < 1e100; }

using Value = std::optional<double> ErrorPoint::*;

std::string line_path(const std::vector<ErrorPoint>& points, Value value, const Axis& x, const Axis& y) {
  std::string d;
  for (const ErrorPoint& p : points) {
    if (!(p.*value) || !plottable(*(p.*value))) continue;
    d += d.empty() ? 'M' : 'L';
    d += px(x.map(p.wall_seconds)) + "," + px(y.map(*(p.*value)));
  }
  return d;
}

std::string text(double x, double y, const char* anchor, const std::string& label,
                 const char* cls = "lm-text") {
  return "<text x=\"" + px(x) + "\" y=\"" + px(y) + "\" text-anchor=\"" + anchor + "\" class=\"" + cls +
         "\">" + label + "</text>\n";
}

std::string line(double x0, double y0, double x1, double y1, const char* cls) {
  return "<line x1=\"" + px(x0) + "\" y1=\"" + px(y0) + "\" x2=\"" + px(x1) + "\" y2=\"" + px(y1) +
         "\" class=\"" + cls + "\"/>\n";
}

constexpr const char* kStyle = R"(<style>
.lm-back{fill:#ffffff}.lm-text{fill:#30343b;font:12px system-ui,sans-serif}.lm-title{fill:#14171c;font:600 14px system-ui,sans-serif}
.lm-frame{stroke:#7a808a;fill:none}.lm-grid{stroke:#dfe2e7}.lm-minor{stroke:#eff1f4}
.lm-band{fill:#1f6fd6;fill-opacity:.18}.lm-line{stroke:#1f6fd6;stroke-width:2;fill:none}.lm-dot{fill:#1f6fd6}
.lm-true{stroke:#c2410c;stroke-width:2;stroke-dasharray:6 4;fill:none}.lm-guide{stroke:#7a808a;stroke-dasharray:2 4;fill:none}
@media (prefers-color-scheme:dark){.lm-back{fill:#15181d}.lm-text{fill:#c6cbd3}.lm-title{fill:#eef0f3}
.lm-frame{stroke:#868d99}.lm-grid{stroke:#2c323b}.lm-minor{stroke:#20252c}
.lm-band{fill:#6aa9ff;fill-opacity:.25}.lm-line{stroke:#6aa9ff}.lm-dot{fill:#6aa9ff}.lm-true{stroke:#ff9d66}.lm-guide{stroke:#99a1ad}}
</style>
)";

}  // namespace

std::string error_svg(const ErrorCurve& curve) {
  std::vector<ErrorPoint> points;
  double x_low = 1e300, x_high = 0, y_low = 1e300, y_high = 0;
  for (const ErrorPoint& p : curve.points) {
    if (!plottable(p.wall_seconds)) continue;
    bool any = false;
    for (const Value value : {&ErrorPoint::relmse, &ErrorPoint::true_relmse}) {
      if (!(p.*value) || !plottable(*(p.*value))) continue;
      any = true;
      y_low = std::min(y_low, *(p.*value));
      y_high = std::max(y_high, *(p.*value));
    }
    if (!any) continue;
    x_low = std::min(x_low, p.wall_seconds);
    x_high = std::max(x_high, p.wall_seconds);
    points.push_back(p);
  }
  // A band that reaches down to 0 or far up must not squeeze the curve: it is clipped to a decade around it.
  for (const ErrorPoint& p : points) {
    if (!p.relmse || !plottable(*p.relmse)) continue;
    if (p.relmse_high && plottable(*p.relmse_high))
      y_high = std::max(y_high, std::min(*p.relmse_high, 10 * *p.relmse));
    if (p.relmse_low && plottable(*p.relmse_low))
      y_low = std::min(y_low, std::max(*p.relmse_low, *p.relmse / 10));
  }

  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + px(kWidth) + " " +
                    px(kHeight) + "\" width=\"" + px(kWidth) + "\" height=\"" + px(kHeight) +
                    "\" role=\"img\" aria-label=\"Error against run time\">\n";
  svg += kStyle;
  svg += "<rect width=\"" + px(kWidth) + "\" height=\"" + px(kHeight) + "\" class=\"lm-back\"/>\n";
  std::string title = "Error against run time";
  if (!curve.job_name.empty()) title += ": " + escape_markup(curve.job_name);
  svg += text(kLeft, 26, "start", title, "lm-title");

  const double right = kWidth - kRight, bottom = kHeight - kBottom;
  if (points.empty()) {
    svg += "<rect x=\"" + px(kLeft) + "\" y=\"" + px(kTop) + "\" width=\"" + px(right - kLeft) +
           "\" height=\"" + px(bottom - kTop) + "\" class=\"lm-frame\"/>\n";
    svg += text((kLeft + right) / 2, (kTop + bottom) / 2, "middle",
                "No estimate yet: it takes two batches of 16 samples per pixel (32 spp).");
    return svg + "</svg>\n";
  }

  Axis x{1, 10, kLeft, right}, y{1, 10, bottom, kTop};
  set_range(&x, x_low, x_high, 4);
  set_range(&y, y_low, y_high, 10);
  for (const Tick& tick : ticks_of(x)) {
    const double at = x.map(tick.value);
    svg += line(at, kTop, at, bottom, tick.labelled ? "lm-grid" : "lm-minor");
    if (tick.labelled) svg += text(at, bottom + 18, "middle", tick_label(tick.value));
  }
  for (const Tick& tick : ticks_of(y)) {
    const double at = y.map(tick.value);
    svg += line(kLeft, at, right, at, tick.labelled ? "lm-grid" : "lm-minor");
    if (tick.labelled) svg += text(kLeft - 8, at + 4, "end", tick_label(tick.value));
  }
  svg += "<rect x=\"" + px(kLeft) + "\" y=\"" + px(kTop) + "\" width=\"" + px(right - kLeft) +
         "\" height=\"" + px(bottom - kTop) + "\" class=\"lm-frame\"/>\n";
  svg += text((kLeft + right) / 2, kHeight - 18, "middle", "render wall time (s)");
  svg += "<text transform=\"translate(22," + px((kTop + bottom) / 2) +
         ") rotate(-90)\" text-anchor=\"middle\" class=\"lm-text\">relMSE</text>\n";

  // The band, there and back.
  std::string upper, lower;
  for (const ErrorPoint& p : points) {
    if (!p.relmse_low || !p.relmse_high) continue;
    const std::string at = px(x.map(p.wall_seconds)) + ",";
    upper += upper.empty() ? 'M' : 'L';
    upper += at + px(y.map(*p.relmse_high));
    lower.insert(0, "L" + at + px(y.map(*p.relmse_low)));
  }
  if (!upper.empty()) svg += "<path d=\"" + upper + lower + "Z\" class=\"lm-band\"/>\n";

  // The guide passes through the last point: error * time = constant, cut to the frame.
  const ErrorPoint& last = points.back();
  const double product = last.wall_seconds * last.relmse.value_or(last.true_relmse.value_or(0));
  const double guide_low = std::max(x.low, product / y.high), guide_high = std::min(x.high, product / y.low);
  if (guide_low < guide_high) {
    svg += line(x.map(guide_low), y.map(product / guide_low), x.map(guide_high), y.map(product / guide_high),
                "lm-guide");
  }
  const std::string estimate = line_path(points, &ErrorPoint::relmse, x, y);
  const std::string truth = line_path(points, &ErrorPoint::true_relmse, x, y);
  if (!estimate.empty()) svg += "<path d=\"" + estimate + "\" class=\"lm-line\"/>\n";
  if (!truth.empty()) svg += "<path d=\"" + truth + "\" class=\"lm-true\"/>\n";
  for (const ErrorPoint& p : points) {
    if (!p.relmse || !plottable(*p.relmse)) continue;
    svg += "<circle cx=\"" + px(x.map(p.wall_seconds)) + "\" cy=\"" + px(y.map(*p.relmse)) +
           "\" r=\"3\" class=\"lm-dot\"><title>" + short_duration(p.wall_seconds) + ", " +
           short_number(p.spp) + " spp: relMSE " + short_number(*p.relmse) + "</title></circle>\n";
  }

  double legend = kTop + 18;
  const auto entry = [&](const char* cls, const std::string& label) {
    svg += line(right - 190, legend - 4, right - 166, legend - 4, cls);
    svg += text(right - 160, legend, "start", label);
    legend += 17;
  };
  if (!estimate.empty()) entry("lm-line", "estimate, 95 % interval");
  if (!truth.empty()) entry("lm-true", "against the reference");
  entry("lm-guide", "1/time");
  return svg + "</svg>\n";
}

}  // namespace lightmill
