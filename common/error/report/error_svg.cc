// The plot of curves: log-log relMSE against wall seconds, the interval as a band, the true error as a dashed
// line where a reference is known, and a guide of slope -1 (error falls as 1/time).
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "common/error/report/report.h"
#include "common/error/report/report_text.h"
#include "common/error/report/svg_chart.h"

namespace lightmill {

namespace {

constexpr double kWidth = 760, kHeight = 460;
constexpr double kLeft = 84, kRight = 24, kTop = 44, kBottom = 60;
constexpr size_t kLegendName = 44;  // characters of a run's name

using Value = std::optional<double> ErrorPoint::*;

/// Points that have anything to show.
std::vector<ErrorPoint> visible(const ErrorCurve& curve) {
  std::vector<ErrorPoint> points;
  for (const ErrorPoint& p : curve.points) {
    if (!plottable(p.wall_seconds)) continue;
    if ((p.relmse && plottable(*p.relmse)) || (p.true_relmse && plottable(*p.true_relmse)))
      points.push_back(p);
  }
  return points;
}

struct Range {
  double low = 1e300, high = 0;
  void include(double v) {
    low = std::min(low, v);
    high = std::max(high, v);
  }
};

void include(const ErrorPoint& p, Range* x, Range* y) {
  x->include(p.wall_seconds);
  for (const Value value : {&ErrorPoint::relmse, &ErrorPoint::true_relmse, &ErrorPoint::denoised_relmse}) {
    if (p.*value && plottable(*(p.*value))) y->include(*(p.*value));
  }
  // A band that reaches down to 0 or far up must not squeeze the curve: it is clipped to a decade around it.
  if (!p.relmse || !plottable(*p.relmse)) return;
  if (p.relmse_high && plottable(*p.relmse_high)) y->include(std::min(*p.relmse_high, 10 * *p.relmse));
  if (p.relmse_low && plottable(*p.relmse_low)) y->include(std::max(*p.relmse_low, *p.relmse / 10));
}

std::string at(const LogAxis& x, const LogAxis& y, double seconds, double value) {
  return svg_number(x.map(seconds)) + "," + svg_number(y.map(value));
}

std::string path(const std::vector<ErrorPoint>& points, Value value, const LogAxis& x, const LogAxis& y) {
  std::string d;
  for (const ErrorPoint& p : points) {
    if (!(p.*value) || !plottable(*(p.*value))) continue;
    d += d.empty() ? 'M' : 'L';
    d += at(x, y, p.wall_seconds, *(p.*value));
  }
  return d;
}

/// The interval, there and back.
std::string band(const std::vector<ErrorPoint>& points, Value low, Value high, const LogAxis& x,
                 const LogAxis& y) {
  std::string upper, lower;
  for (const ErrorPoint& p : points) {
    if (!(p.*low) || !(p.*high)) continue;
    upper += upper.empty() ? 'M' : 'L';
    upper += at(x, y, p.wall_seconds, *(p.*high));
    lower = std::string("L").append(at(x, y, p.wall_seconds, *(p.*low))).append(lower);
  }
  return upper.empty() ? "" : upper + lower + "Z";
}

std::string dots(const std::vector<ErrorPoint>& points, const LogAxis& x, const LogAxis& y,
                 const std::string& series) {
  std::string svg;
  for (const ErrorPoint& p : points) {
    if (!p.relmse || !plottable(*p.relmse)) continue;
    svg += "<circle cx=\"" + svg_number(x.map(p.wall_seconds)) + "\" cy=\"" + svg_number(y.map(*p.relmse)) +
           "\" r=\"3\" class=\"lm-dot" + series + "\"><title>" + short_duration(p.wall_seconds) + ", " +
           short_number(p.spp) + " spp: relMSE " + short_number(*p.relmse) + "</title></circle>\n";
  }
  return svg;
}

/// A line error * time = `product`, cut to the frame.
std::string guide(double product, const LogAxis& x, const LogAxis& y) {
  const double from = std::max(x.low, product / y.high), to = std::min(x.high, product / y.low);
  if (!(from < to)) return "";
  return svg_line(x.map(from), y.map(product / from), x.map(to), y.map(product / to), "lm-guide");
}

struct LegendEntry {
  std::string cls, label;
};

std::string legend(const std::vector<LegendEntry>& entries, double right) {
  size_t longest = 0;
  for (const LegendEntry& e : entries) longest = std::max(longest, e.label.size());
  const double width = 44 + 6.6 * static_cast<double>(longest), left = right - width - 8;
  std::string svg = "<rect x=\"" + svg_number(left) + "\" y=\"" + svg_number(kTop + 6) + "\" width=\"" +
                    svg_number(width) + "\" height=\"" +
                    svg_number(17 * static_cast<double>(entries.size()) + 8) + "\" class=\"lm-plate\"/>\n";
  double y = kTop + 22;
  for (const LegendEntry& e : entries) {
    svg += svg_line(left + 6, y - 4, left + 30, y - 4, e.cls);
    svg += svg_text(left + 36, y, "start", escape_markup(e.label));
    y += 17;
  }
  return svg;
}

}  // namespace

std::string error_svg(const std::vector<ErrorCurve>& curves) {
  const bool single = curves.size() == 1;
  std::vector<std::vector<ErrorPoint>> all;
  Range x_range, y_range;
  for (const ErrorCurve& curve : curves) {
    all.push_back(visible(curve));
    for (const ErrorPoint& p : all.back()) include(p, &x_range, &y_range);
  }
  std::string title = "Error against run time";
  if (single && !curves[0].job_name.empty()) title += ": " + curves[0].job_name;
  std::string svg = chart_head(kWidth, kHeight, title);
  const double right = kWidth - kRight, bottom = kHeight - kBottom;
  LogAxis x{1, 10, kLeft, right}, y{1, 10, bottom, kTop};
  if (x_range.high == 0) {
    svg += "<rect x=\"" + svg_number(kLeft) + "\" y=\"" + svg_number(kTop) + "\" width=\"" +
           svg_number(right - kLeft) + "\" height=\"" + svg_number(bottom - kTop) +
           "\" class=\"lm-frame\"/>\n";
    svg += svg_text((kLeft + right) / 2, (kTop + bottom) / 2, "middle",
                    "No estimate yet: it takes two batches of 16 samples per pixel (32 spp).");
    return svg + "</svg>\n";
  }
  x.set_range(x_range.low, x_range.high, 4);
  y.set_range(y_range.low, y_range.high, 10);
  svg += chart_frame(x, y, "render wall time (s)", "relMSE");

  std::vector<LegendEntry> entries;
  for (size_t i = 0; i < all.size(); ++i) {
    const std::string d = band(all[i], &ErrorPoint::relmse_low, &ErrorPoint::relmse_high, x, y);
    if (!d.empty())
      svg += "<path d=\"" + d + "\" class=\"lm-band" + std::to_string(i % kChartColours) + "\"/>\n";
    // Several runs' would be too many lines.
    const std::string of_denoised =
        single ? band(all[i], &ErrorPoint::denoised_relmse_low, &ErrorPoint::denoised_relmse_high, x, y) : "";
    if (!of_denoised.empty()) svg += "<path d=\"" + of_denoised + "\" class=\"lm-band2\"/>\n";
  }
  for (size_t i = 0; i < all.size(); ++i) {
    if (all[i].empty()) continue;
    const std::string series = std::to_string(i % kChartColours);
    const ErrorPoint& last = all[i].back();
    if (i == 0) svg += guide(last.wall_seconds * last.relmse.value_or(last.true_relmse.value_or(0)), x, y);
    const std::string estimate = path(all[i], &ErrorPoint::relmse, x, y);
    const std::string truth = path(all[i], &ErrorPoint::true_relmse, x, y);
    // One run's true error has a colour of its own, several runs' have that of their run.
    const std::string truth_class = "lm-true" + (single ? std::string("1") : series);
    if (!estimate.empty()) svg += "<path d=\"" + estimate + "\" class=\"lm-line" + series + "\"/>\n";
    if (!truth.empty()) svg += "<path d=\"" + truth + "\" class=\"" + truth_class + "\"/>\n";
    svg += dots(all[i], x, y, series);
    const std::string denoised = single ? path(all[i], &ErrorPoint::denoised_relmse, x, y) : "";
    if (!denoised.empty()) svg += "<path d=\"" + denoised + "\" class=\"lm-line2\"/>\n";
    if (single) {
      if (!estimate.empty()) entries.push_back({"lm-line0", "estimate, 95 % interval"});
      if (!denoised.empty()) entries.push_back({"lm-line2", "denoised, 95 % interval"});
      if (!truth.empty()) entries.push_back({truth_class, "against the reference"});
    } else {
      entries.push_back({"lm-line" + series, utf8_prefix(curves[i].job_name, kLegendName)});
      if (!truth.empty() && i == 0) entries.push_back({truth_class, "dashed: against the reference"});
    }
  }
  entries.push_back({"lm-guide", "1/time"});
  return svg + legend(entries, right) + "</svg>\n";
}

}  // namespace lightmill
