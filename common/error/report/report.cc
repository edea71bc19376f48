#include "common/error/report/report.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/base/error.h"
#include "common/error/box_figures.h"
#include "common/error/report/pilot_section.h"
#include "common/error/report/report_files.h"
#include "common/error/report/report_text.h"
#include "common/error/report/scales_section.h"
#include "common/film/dropped_text.h"

namespace lightmill {

namespace {

/// The columns that version 0.1 had; those of box_figures() follow them.
constexpr const char* kOlderCsvHeader =
    "wall_s,cpu_s,spp,relmse,relmse_low,relmse_high,batches,true_relmse,true_relmse_trimmed,true_flip";
constexpr size_t kOlderCsvColumns = 10;

std::string csv_header() {
  std::string header = kOlderCsvHeader;
  for (const BoxFigure& figure : box_figures()) header += "," + figure.name;
  return header;
}

/// The last columns, which files of versions without them lack.
constexpr const char* kDenoisedColumns = ",denoised_relmse,denoised_relmse_low,denoised_relmse_high";
constexpr size_t kDenoisedFigures = 3;

std::string cell(const std::optional<double>& value) { return value ? exact_number(*value) : ""; }

}  // namespace

std::string error_csv(const ErrorCurve& curve) {
  std::string csv = csv_header() + kDenoisedColumns + "\n";
  for (const ErrorPoint& p : curve.points) {
    csv += exact_number(p.wall_seconds) + "," + exact_number(p.cpu_seconds) + "," + exact_number(p.spp) +
           "," + cell(p.relmse) + "," + cell(p.relmse_low) + "," + cell(p.relmse_high) + "," +
           std::to_string(p.batches) + "," + cell(p.true_relmse) + "," + cell(p.true_relmse_trimmed) + "," +
           cell(p.true_flip);
    for (const BoxFigure& figure : box_figures()) csv += "," + cell(figure.of(p.boxes));
    csv += "," + cell(p.denoised_relmse) + "," + cell(p.denoised_relmse_low) + "," +
           cell(p.denoised_relmse_high);
    csv += "\n";
  }
  return csv;
}

namespace {

std::string row(const std::string& name, const std::string& value) {
  return "<tr><th scope=\"row\">" + escape_markup(name) + "</th><td>" + escape_markup(value) + "</td></tr>\n";
}

/// The settings as rows "a.b = value"; text that is not JSON is shown as it is.
std::string settings_rows(const std::string& settings_json) {
  if (settings_json.empty()) return "";
  const auto json = nlohmann::json::parse(settings_json, nullptr, false);
  if (json.is_discarded() || !json.is_object()) return row("settings", settings_json);
  std::string rows;
  for (const auto& [key, value] : json.items()) {
    rows +=
        row(key, value.is_string() ? value.get<std::string>()
                                   : value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  return rows;
}

std::string result_rows(const ErrorPoint& p, const ReportInfo& info, const Image& image) {
  std::string rows;
  rows += row("image", std::to_string(image.width) + " × " + std::to_string(image.height) + " pixels");
  rows += row("samples per pixel", short_number(p.spp, 6));
  rows += row("render wall time", short_duration(p.wall_seconds));
  rows += row("CPU time of the workers", short_duration(p.cpu_seconds));
  if (p.wall_seconds > 0) {
    const double samples = p.spp * image.width * image.height;
    rows += row("samples per second", short_number(samples / p.wall_seconds, 4));
    if (p.cpu_seconds > 0) rows += row("samples per CPU second", short_number(samples / p.cpu_seconds, 4));
  }
  rows += row("estimated relMSE now", p.relmse ? interval_text(p.relmse, p.relmse_low, p.relmse_high)
                                               : "unknown (needs 2 batches of 16 spp)");
  rows += row("independent batches", std::to_string(p.batches));
  if (p.true_relmse) rows += row("relMSE against the reference", short_number(*p.true_relmse));
  if (p.true_relmse_trimmed) {
    rows += row("the same without the worst 0.1 % of pixels", short_number(*p.true_relmse_trimmed));
  }
  if (p.true_flip) rows += row("FLIP against the reference", short_number(*p.true_flip));
  const RenderCounters& c = info.counters;
  rows += row("camera paths", std::to_string(c.camera_paths));
  rows += row("light paths", std::to_string(c.light_paths));
  rows += row("closest-hit rays", std::to_string(c.closest_hit_rays));
  rows += row("shadow rays", std::to_string(c.shadow_rays));
  rows += row("connections of zero, no shadow ray cast", std::to_string(c.zero_connections_skipped));
  rows += row("connections dropped by roulette", std::to_string(c.rouletted_connections));
  const std::vector<DroppedLine> dropped = dropped_lines(info.dropped, c.nonfinite);
  if (dropped.empty()) rows += row("dropped", "nothing");
  for (const DroppedLine& line : dropped) {
    if (!line.warning) rows += row("dropped", line.text);
  }
  return rows;
}

std::string curve_rows(const ErrorCurve& curve) {
  std::string html =
      "<table>\n<tr><th>wall</th><th>CPU</th><th>spp</th><th>estimated relMSE</th><th>denoised</th><th>true "
      "relMSE</th>"
      "<th>trimmed</th><th>FLIP</th></tr>\n";
  const auto number = [](const std::optional<double>& v) { return v ? short_number(*v) : std::string(); };
  for (const ErrorPoint& p : curve.points) {
    html += "<tr><td>" + short_duration(p.wall_seconds) + "</td><td>" + short_duration(p.cpu_seconds) +
            "</td><td>" + short_number(p.spp, 6) + "</td><td>" +
            interval_text(p.relmse, p.relmse_low, p.relmse_high) + "</td><td>" +
            interval_text(p.denoised_relmse, p.denoised_relmse_low, p.denoised_relmse_high) + "</td><td>" +
            number(p.true_relmse) + "</td><td>" + number(p.true_relmse_trimmed) + "</td><td>" +
            number(p.true_flip) + "</td></tr>\n";
  }
  return html + "</table>\n";
}

std::string make_html(const ReportInfo& info, const ErrorCurve& curve, const Image& image) {
  const ErrorPoint now = curve.points.empty() ? ErrorPoint{} : curve.points.back();
  std::string html = html_head(info.title.empty() ? "Lightmill report" : info.title);
  html += "<figure><img alt=\"The rendered image\" width=\"" + std::to_string(image.width) + "\" height=\"" +
          std::to_string(image.height) + "\" src=\"data:image/png;base64," + base64(encode_png(image)) +
          "\"></figure>\n";
  html += "<h2>Result</h2>\n<table>\n" + result_rows(now, info, image) + "</table>\n";
  html += scales_section(now);
  html += "<h2>What more time buys</h2>\n" + curve_statements(curve);
  html += "<h2>Error against run time</h2>\n<figure>" + error_svg({curve}) +
          "<figcaption>relMSE = mean of (I−R)²/(R²+0.01) over pixels and channels. The estimate comes from "
          "independent batches of samples; in 95 of 100 renders its interval holds the error of the "
          "image.</figcaption></figure>\n";
  html += "<details><summary>All points (error.csv)</summary>\n" + curve_rows(curve) + "</details>\n";
  for (const std::string& line : info.missing_light)
    html += "<p><strong>Missing light:</strong> " + escape_markup(line) + ".</p>\n";
  for (const DroppedLine& line : dropped_lines(info.dropped, info.counters.nonfinite)) {
    if (line.warning) html += "<p><strong>Dropped light:</strong> " + escape_markup(line.text) + ".</p>\n";
  }
  if (info.pilot) html += pilot_section(*info.pilot);
  html += "<h2>Settings</h2>\n<table>\n" + settings_rows(info.settings_json) + "</table>\n";
  return html + "</body>\n</html>\n";
}

}  // namespace

void write_report(const std::string& folder, const ReportInfo& info, const ErrorCurve& curve,
                  const Image& image) {
  make_report_folder(folder);
  write_report_file(folder, "error.csv", error_csv(curve));
  write_report_file(folder, "error.svg", error_svg({curve}));
  if (!info.plan_json.empty()) write_report_file(folder, "plan.json", info.plan_json + "\n");
  write_report_file(folder, "report.html", make_html(info, curve, image));
}

ErrorCurve read_report_csv(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    throw Error(ErrorKind::kFailed, path + ": can't read the report's curve; is this a report folder?");
  ErrorCurve curve;
  std::string text;
  size_t columns = 0;
  for (int line = 1; std::getline(in, text); ++line) {
    const auto fail = [&](const std::string& why) {
      throw Error(ErrorKind::kFailed, path + ":" + std::to_string(line) + ": " + why);
    };
    if (!text.empty() && text.back() == '\r') text.pop_back();
    if (line == 1) {
      const std::string scales = csv_header(), header = scales + kDenoisedColumns;
      if (text != header && text != scales && text != kOlderCsvHeader)
        fail("expected the header \"" + header + "\"");
      columns = kOlderCsvColumns;
      if (text != kOlderCsvHeader) columns += box_figures().size();
      if (text == header) columns += kDenoisedFigures;
      continue;
    }
    std::vector<std::optional<double>> cells;
    for (size_t begin = 0; begin <= text.size();) {
      const size_t end = std::min(text.find(',', begin), text.size());
      std::optional<double> value;
      if (end > begin) {
        double v = 0;
        const auto parsed = std::from_chars(text.data() + begin, text.data() + end, v);
        if (parsed.ec != std::errc() || parsed.ptr != text.data() + end || !std::isfinite(v)) {
          fail("\"" + text.substr(begin, std::min<size_t>(end - begin, 40)) + "\" is not a number");
        }
        value = v;
      }
      cells.push_back(value);
      if (cells.size() > columns) fail("more than " + std::to_string(columns) + " cells");
      begin = end + 1;
    }
    if (cells.size() != columns)
      fail("expected " + std::to_string(columns) + " cells, found " + std::to_string(cells.size()));
    if (!cells[0] || !cells[1] || !cells[2] || !cells[6])
      fail("wall_s, cpu_s, spp and batches must not be empty");
    if (*cells[6] < 0 || *cells[6] > 1e9 || *cells[6] != std::floor(*cells[6]))
      fail("batches is not a count");
    ErrorPoint p;
    p.wall_seconds = *cells[0];
    p.cpu_seconds = *cells[1];
    p.spp = *cells[2];
    p.relmse = cells[3];
    p.relmse_low = cells[4];
    p.relmse_high = cells[5];
    p.batches = static_cast<int>(*cells[6]);
    p.true_relmse = cells[7];
    p.true_relmse_trimmed = cells[8];
    p.true_flip = cells[9];
    const size_t scales = kOlderCsvColumns + box_figures().size();
    for (size_t i = kOlderCsvColumns; i < std::min(columns, scales); ++i) {
      box_figures()[i - kOlderCsvColumns].of(p.boxes) = cells[i];
    }
    if (columns > scales) {
      p.denoised_relmse = cells[scales];
      p.denoised_relmse_low = cells[scales + 1];
      p.denoised_relmse_high = cells[scales + 2];
    }
    curve.points.push_back(p);
  }
  return curve;
}

}  // namespace lightmill
