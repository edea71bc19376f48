#include "common/error/report/scales_section.h"

#include <optional>

#include "common/error/report/report_text.h"

namespace lightmill {

namespace {

std::string scale_ratio(const std::optional<double>& value, const std::optional<double>& of_pixels) {
  return value && of_pixels && *of_pixels > 0 ? short_number(*value / *of_pixels) : "";
}

std::string scale_row(const std::string& name, const BoxError& e, const ErrorPoint& pixels) {
  std::string html = "<tr><td>" + name + "</td><td>" + interval_text(e.relmse, e.relmse_low, e.relmse_high) +
                     "</td><td>" + scale_ratio(e.relmse, pixels.relmse) + "</td>";
  if (pixels.true_relmse) {
    html += "<td>" + (e.true_relmse ? short_number(*e.true_relmse) : "") + "</td><td>" +
            scale_ratio(e.true_relmse, pixels.true_relmse) + "</td>";
  }
  return html + "</tr>\n";
}

}  // namespace

std::string scales_section(const ErrorPoint& point) {
  if (point.boxes == BoxErrors{}) return "";
  std::string html =
      "<h2>Error at several scales</h2>\n<table>\n<tr><th>means over</th><th>estimated relMSE</th>"
      "<th>ratio to the pixels</th>";
  if (point.true_relmse) html += "<th>relMSE against the reference</th><th>ratio to the pixels</th>";
  html += "</tr>\n";
  html += scale_row("single pixels", {point.relmse, point.relmse_low, point.relmse_high, point.true_relmse},
                    point);
  for (size_t i = 0; i < kBoxSides.size(); ++i) {
    if (point.boxes[i] == BoxError{}) continue;
    const std::string side = std::to_string(kBoxSides[i]);
    html += scale_row(side + " × " + side + " pixels", point.boxes[i], point);
  }
  return html +
         "</table>\n<p>The relMSE of a mean is multiplied by the number of its pixels, so noise of "
         "independent "
         "pixels has the same at every scale: a ratio well above 1 is structure that eyes see from afar and "
         "denoisers keep, and one below 1 says that errors of neighbours cancel.</p>\n";
}

}  // namespace lightmill
