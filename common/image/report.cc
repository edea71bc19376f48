#include "common/image/report.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "common/error.h"
#include "common/image/report_text.h"

namespace lightmill {

namespace {

namespace fs = std::filesystem;

constexpr const char* kCsvHeader =
    "wall_s,cpu_s,spp,relmse,relmse_low,relmse_high,batches,true_relmse,true_relmse_trimmed,true_flip";
constexpr size_t kCsvColumns = 10;

void write_file(const fs::path& path, const std::string& content) {
  // Beside it and renamed: a reader of a running job's report never sees half a file.
  fs::path temporary = path;
  temporary += ".part";
  std::ofstream out(temporary, std::ios::binary);
  out << content;
  out.close();
  std::error_code ec;
  if (!out) {
    const int why = errno;
    fs::remove(temporary, ec);
    throw Error(ErrorKind::kFailed, path.string() + ": can't write the report (" +
                                        std::error_code(why, std::generic_category()).message() +
                                        "); choose another folder with --report");
  }
  fs::rename(temporary, path, ec);
  if (ec) throw Error(ErrorKind::kFailed, path.string() + ": can't write the report (" + ec.message() + ")");
}

std::string cell(const std::optional<double>& value) { return value ? exact_number(*value) : ""; }

std::string make_csv(const ErrorCurve& curve) {
  std::string csv = std::string(kCsvHeader) + "\n";
  for (const ErrorPoint& p : curve.points) {
    csv += exact_number(p.wall_seconds) + "," + exact_number(p.cpu_seconds) + "," + exact_number(p.spp) +
           "," + cell(p.relmse) + "," + cell(p.relmse_low) + "," + cell(p.relmse_high) + "," +
           std::to_string(p.batches) + "," + cell(p.true_relmse) + "," + cell(p.true_relmse_trimmed) + "," +
           cell(p.true_flip) + "\n";
  }
  return csv;
}

std::string row(const std::string& name, const std::string& value) {
  return "<tr><th scope=\"row\">" + escape_markup(name) + "</th><td>" + escape_markup(value) + "</td></tr>\n";
}

std::string interval_text(const ErrorPoint& p, double factor) {
  if (!p.relmse) return "unknown (needs 2 batches of 16 spp)";
  std::string s = short_number(*p.relmse * factor);
  if (p.relmse_low && p.relmse_high) {
    s += " (95 %: " + short_number(*p.relmse_low * factor) + " to " + short_number(*p.relmse_high * factor) +
         ")";
  }
  return s;
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
  rows += row("estimated relMSE now", interval_text(p, 1));
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
  rows += row("non-finite contributions dropped", std::to_string(c.nonfinite));
  return rows;
}

/// What more time buys, by error ~ 1/samples and samples ~ time.
std::string outlook(const ErrorPoint& p) {
  if (!p.relmse || !(p.wall_seconds > 0)) {
    return "<p>Not known yet: the estimate takes two complete batches of 16 samples per pixel.</p>\n";
  }
  std::string html = "<table>\n<tr><th>more render time</th><th>expected relMSE</th><th>error × </th></tr>\n";
  for (const double more : {60.0, 600.0, 3600.0}) {
    const double factor = p.wall_seconds / (p.wall_seconds + more);
    html += "<tr><td>" + short_duration(more) + "</td><td>" + escape_markup(interval_text(p, factor)) +
            "</td><td>" + short_number(factor) + "</td></tr>\n";
  }
  html += "</table>\n<p>Another minute takes the relMSE from " + short_number(*p.relmse) + " to about " +
          short_number(*p.relmse * p.wall_seconds / (p.wall_seconds + 60)) + "; halving it takes another " +
          short_duration(p.wall_seconds) +
          ". This is extrapolated by the 1/N law of independent samples at the pace so far.</p>\n";
  return html;
}

std::string curve_rows(const ErrorCurve& curve) {
  std::string html =
      "<table>\n<tr><th>wall</th><th>CPU</th><th>spp</th><th>estimated relMSE</th><th>true relMSE</th>"
      "<th>trimmed</th><th>FLIP</th></tr>\n";
  const auto number = [](const std::optional<double>& v) { return v ? short_number(*v) : std::string(); };
  for (const ErrorPoint& p : curve.points) {
    html += "<tr><td>" + short_duration(p.wall_seconds) + "</td><td>" + short_duration(p.cpu_seconds) +
            "</td><td>" + short_number(p.spp, 6) + "</td><td>" +
            (p.relmse ? escape_markup(interval_text(p, 1)) : "") + "</td><td>" + number(p.true_relmse) +
            "</td><td>" + number(p.true_relmse_trimmed) + "</td><td>" + number(p.true_flip) + "</td></tr>\n";
  }
  return html + "</table>\n";
}

constexpr const char* kHtmlStyle = R"(<style>
:root{color-scheme:light dark;--back:#fff;--text:#20242b;--dim:#5c636e;--rule:#dfe2e7}
@media (prefers-color-scheme:dark){:root{--back:#15181d;--text:#dfe3e9;--dim:#99a1ad;--rule:#2c323b}}
body{background:var(--back);color:var(--text);font:15px/1.5 system-ui,sans-serif;max-width:860px;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}p,figcaption{color:var(--dim)}
table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.25rem .75rem .25rem 0;border-bottom:1px solid var(--rule);font-weight:400;overflow-wrap:anywhere}
th{color:var(--dim)}td{font-variant-numeric:tabular-nums}img,svg{max-width:100%;height:auto}figure{margin:1rem 0}
</style>
)";

std::string make_html(const ReportInfo& info, const ErrorCurve& curve, const Image& image) {
  const ErrorPoint now = curve.points.empty() ? ErrorPoint{} : curve.points.back();
  const std::string title = escape_markup(info.title.empty() ? "Lightmill report" : info.title);
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      title + "</title>\n" + kHtmlStyle + "</head>\n<body>\n<h1>" + title + "</h1>\n";
  html += "<figure><img alt=\"The rendered image\" width=\"" + std::to_string(image.width) + "\" height=\"" +
          std::to_string(image.height) + "\" src=\"data:image/png;base64," + base64(encode_png(image)) +
          "\"></figure>\n";
  html += "<h2>Result</h2>\n<table>\n" + result_rows(now, info, image) + "</table>\n";
  html += "<h2>What another minute buys</h2>\n" + outlook(now);
  html += "<h2>Error against run time</h2>\n<figure>" + error_svg(curve) +
          "<figcaption>relMSE = mean of (I−R)²/(R²+0.01) over pixels and channels. The estimate comes from "
          "independent batches of samples, its interval is Student's t over them.</figcaption></figure>\n";
  html += "<details><summary>All points (error.csv)</summary>\n" + curve_rows(curve) + "</details>\n";
  html += "<h2>Settings</h2>\n<table>\n" + settings_rows(info.settings_json) + "</table>\n";
  return html + "</body>\n</html>\n";
}

}  // namespace

void write_report(const std::string& folder, const ReportInfo& info, const ErrorCurve& curve,
                  const Image& image) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec || !fs::is_directory(folder)) {
    throw Error(ErrorKind::kFailed,
                folder + ": can't make the report's folder (" + (ec ? ec.message() : "it is a file") + ")");
  }
  const fs::path base = folder;
  write_file(base / "error.csv", make_csv(curve));
  write_file(base / "error.svg", error_svg(curve));
  write_file(base / "report.html", make_html(info, curve, image));
}

ErrorCurve read_report_csv(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    throw Error(ErrorKind::kFailed, path + ": can't read the report's curve; is this a report folder?");
  ErrorCurve curve;
  std::string text;
  for (int line = 1; std::getline(in, text); ++line) {
    const auto fail = [&](const std::string& why) {
      throw Error(ErrorKind::kFailed, path + ":" + std::to_string(line) + ": " + why);
    };
    if (!text.empty() && text.back() == '\r') text.pop_back();
    if (line == 1) {
      if (text != kCsvHeader) fail(std::string("expected the header \"") + kCsvHeader + "\"");
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
      if (cells.size() > kCsvColumns) fail("more than 10 cells");
      begin = end + 1;
    }
    if (cells.size() != kCsvColumns) fail("expected 10 cells, found " + std::to_string(cells.size()));
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
    curve.points.push_back(p);
  }
  return curve;
}

}  // namespace lightmill
