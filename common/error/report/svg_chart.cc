#include "common/error/report/svg_chart.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/error/report/report_text.h"

namespace lightmill {

namespace {

struct Tick {
  double value = 1;
  bool labelled = false;
};

/// Decades, with 2 and 5 labelled too where there are few decades, and all of 1..9 as minor ticks; at most
/// about a dozen labels.
std::vector<Tick> ticks_of(const LogAxis& axis) {
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

// Okabe and Ito's colours, darkened for white and lightened for dark pages.
constexpr std::array<const char*, kChartColours> kLight = {"#1f6fd6", "#c2410c", "#0f8a5f", "#8b3fb0",
                                                           "#b08900", "#0891a5", "#d0357f", "#5c636e"};
constexpr std::array<const char*, kChartColours> kDark = {"#6aa9ff", "#ff9d66", "#4fd1a5", "#cf9df0",
                                                          "#e8c14d", "#5fd3e6", "#ff8fc0", "#aab2bf"};

std::string colour_rules(const std::array<const char*, kChartColours>& colours, const char* opacity) {
  std::string css;
  for (size_t i = 0; i < kChartColours; ++i) {
    const std::string n = std::to_string(i), c = colours[i];
    css += ".lm-band" + n + "{fill:" + c + ";fill-opacity:" + opacity + "}.lm-line" + n + "{stroke:" + c +
           ";stroke-width:2;fill:none}.lm-true" + n + "{stroke:" + c +
           ";stroke-width:2;stroke-dasharray:6 4;fill:none}.lm-dot" + n + "{fill:" + c + "}\n";
  }
  return css;
}

std::string style() {
  return std::string("<style>\n") +
         ".lm-back{fill:#ffffff}.lm-text{fill:#30343b;font:12px system-ui,sans-serif}"
         ".lm-title{fill:#14171c;font:600 14px system-ui,sans-serif}\n"
         ".lm-frame{stroke:#7a808a;fill:none}.lm-grid{stroke:#dfe2e7}.lm-minor{stroke:#eff1f4}"
         ".lm-guide{stroke:#7a808a;stroke-dasharray:2 4;fill:none}.lm-plate{fill:#ffffff;fill-opacity:.8}\n" +
         colour_rules(kLight, ".16") +
         "@media "
         "(prefers-color-scheme:dark){.lm-back{fill:#15181d}.lm-text{fill:#c6cbd3}.lm-title{fill:#eef0f3}"
         ".lm-frame{stroke:#868d99}.lm-grid{stroke:#2c323b}.lm-minor{stroke:#20252c}.lm-guide{stroke:#99a1ad}"
         ".lm-plate{fill:#15181d}\n" +
         colour_rules(kDark, ".22") + "}\n</style>\n";
}

}  // namespace

double LogAxis::map(double value) const {
  const double t = (std::log(std::max(value, 1e-300)) - std::log(low)) / (std::log(high) - std::log(low));
  return at_low + std::clamp(t, 0.0, 1.0) * (at_high - at_low);
}

void LogAxis::set_range(double range_low, double range_high, double least) {
  const double middle = std::sqrt(range_low) * std::sqrt(range_high);
  const double half = std::max(std::sqrt(range_high / range_low) * 1.15, std::sqrt(least));
  low = middle / half;
  high = middle * half;
}

bool plottable(double value) { return std::isfinite(value) && value > 1e-100 && value < 1e100; }

std::string svg_number(double v) {
  // Hundredths of a pixel are enough and keep the file small.
  return short_number(std::round(v * 100) / 100, 8);
}

std::string svg_text(double x, double y, const char* anchor, const std::string& label, const char* cls) {
  return "<text x=\"" + svg_number(x) + "\" y=\"" + svg_number(y) + "\" text-anchor=\"" + anchor +
         "\" class=\"" + cls + "\">" + label + "</text>\n";
}

std::string svg_line(double x0, double y0, double x1, double y1, const std::string& cls) {
  return "<line x1=\"" + svg_number(x0) + "\" y1=\"" + svg_number(y0) + "\" x2=\"" + svg_number(x1) +
         "\" y2=\"" + svg_number(y1) + "\" class=\"" + cls + "\"/>\n";
}

std::string chart_head(double width, double height, const std::string& title) {
  const std::string w = svg_number(width), h = svg_number(height);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + w + " " + h + "\" width=\"" + w +
         "\" height=\"" + h + "\" role=\"img\" aria-label=\"" + escape_markup(title) + "\">\n" + style() +
         "<rect width=\"" + w + "\" height=\"" + h + "\" class=\"lm-back\"/>\n" +
         svg_text(84, 26, "start", escape_markup(title), "lm-title");
}

std::string chart_frame(const LogAxis& x, const LogAxis& y, const std::string& x_name,
                        const std::string& y_name) {
  const double left = x.at_low, right = x.at_high, bottom = y.at_low, top = y.at_high;
  std::string svg;
  for (const Tick& tick : ticks_of(x)) {
    const double at = x.map(tick.value);
    svg += svg_line(at, top, at, bottom, tick.labelled ? "lm-grid" : "lm-minor");
    if (tick.labelled) svg += svg_text(at, bottom + 18, "middle", tick_label(tick.value));
  }
  for (const Tick& tick : ticks_of(y)) {
    const double at = y.map(tick.value);
    svg += svg_line(left, at, right, at, tick.labelled ? "lm-grid" : "lm-minor");
    if (tick.labelled) svg += svg_text(left - 8, at + 4, "end", tick_label(tick.value));
  }
  svg += "<rect x=\"" + svg_number(left) + "\" y=\"" + svg_number(top) + "\" width=\"" +
         svg_number(right - left) + "\" height=\"" + svg_number(bottom - top) + "\" class=\"lm-frame\"/>\n";
  svg += svg_text((left + right) / 2, bottom + 42, "middle", escape_markup(x_name));
  svg += "<text transform=\"translate(22," + svg_number((top + bottom) / 2) +
         ") rotate(-90)\" text-anchor=\"middle\" class=\"lm-text\">" + escape_markup(y_name) + "</text>\n";
  return svg;
}

}  // namespace lightmill
