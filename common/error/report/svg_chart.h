#pragma once
// The frame of a log-log chart as SVG: axes, ticks, text, and the style for light and dark pages.
#include <cstddef>
#include <string>
#include <vector>

namespace lightmill {

/// One logarithmic axis: values [low, high] > 0 onto pixels [at_low, at_high].
struct LogAxis {
  double low = 1, high = 10, at_low = 0, at_high = 1;
  double map(double value) const;
  /// Spans [low, high] with a margin, and at least a factor of `least` in all.
  void set_range(double range_low, double range_high, double least);
};

/// Colours that can be told apart in light and dark and by the colour-blind. Series i has classes lm-line{i},
/// lm-band{i}, lm-dot{i} with i modulo this.
inline constexpr size_t kChartColours = 8;

/// Whether a value can be drawn on a logarithmic axis.
bool plottable(double value);
/// A coordinate, in hundredths of a pixel.
std::string svg_number(double v);
/// `label` is markup already.
std::string svg_text(double x, double y, const char* anchor, const std::string& label,
                     const char* cls = "lm-text");
std::string svg_line(double x0, double y0, double x1, double y1, const std::string& cls);

/// The opening tag, style, background and title (plain text) of a chart; "</svg>" is left to the caller.
std::string chart_head(double width, double height, const std::string& title);
/// Grid, ticks, frame and the axes' names. x runs from left to right, y from bottom to top.
std::string chart_frame(const LogAxis& x, const LogAxis& y, const std::string& x_name,
                        const std::string& y_name);

}  // namespace lightmill
