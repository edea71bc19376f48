#include "common/error/report/report_files.h"

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "common/base/error.h"
#include "common/error/error_fit.h"
#include "common/error/report/report_text.h"

namespace lightmill {

namespace {

namespace fs = std::filesystem;

constexpr const char* kStyle = R"(<style>
:root{color-scheme:light dark;--back:#fff;--text:#20242b;--dim:#5c636e;--rule:#dfe2e7}
@media (prefers-color-scheme:dark){:root{--back:#15181d;--text:#dfe3e9;--dim:#99a1ad;--rule:#2c323b}}
body{background:var(--back);color:var(--text);font:15px/1.5 system-ui,sans-serif;max-width:860px;margin:2rem auto;padding:0 1rem}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}h3{font-size:1rem}p,figcaption{color:var(--dim)}p.warning{color:var(--text);border-left:4px solid #c2410c;padding-left:.75rem}
table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.25rem .75rem .25rem 0;border-bottom:1px solid var(--rule);font-weight:400;overflow-wrap:anywhere}
th{color:var(--dim)}td{font-variant-numeric:tabular-nums}img,svg{max-width:100%;height:auto}figure{margin:1rem 0}
</style>
)";

std::string slope_text(const ErrorFit& fit, const char* what) {
  std::string s = std::string("The ") + what + " falls as time to the power of " + short_number(fit.slope) +
                  " (95 %: " + short_number(fit.slope_low) + " to " + short_number(fit.slope_high) +
                  ", from " + std::to_string(fit.points) + " points)";
  if (fit.slope_low > -1) return s + ", slower than the −1 of independent samples at a steady pace";
  if (fit.slope_high < -1) return s + ", faster than −1: the pace has grown meanwhile";
  return s + "; independent samples at a steady pace give −1";
}

std::string prediction_table(const Outlook& o) {
  std::string html =
      "<table>\n<tr><th>error</th><th>relMSE</th><th>with the workers of now</th><th>with twice as many</th>"
      "<th>with four times as many</th></tr>\n";
  for (const double less : {2.0, 4.0, 10.0}) {
    html += "<tr><td>" + short_number(less) + " × less</td><td>" + short_number(o.relmse / less) + "</td>";
    for (const double workers : {1.0, 2.0, 4.0}) {
      html += "<td>in another " + short_duration(o.seconds(less, workers)) + "</td>";
    }
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

}  // namespace

void make_report_folder(const std::string& folder) {
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec || !fs::is_directory(folder)) {
    throw Error(ErrorKind::kFailed,
                folder + ": can't make the report's folder (" + (ec ? ec.message() : "it is a file") + ")");
  }
}

void write_report_file(const std::string& folder, const std::string& name, const std::string& content) {
  const fs::path path = fs::path(folder) / name;
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

std::string csv_cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c == '\n' || c == '\r' ? ' ' : c;
  }
  return quoted + "\"";
}

std::string html_head(const std::string& title) {
  const std::string t = escape_markup(title);
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
         t + "</title>\n" + kStyle + "</head>\n<body>\n<h1>" + t + "</h1>\n";
}

std::string curve_statements(const ErrorCurve& curve) {
  std::string html;
  if (const auto fit = fit_error(curve, false))
    html += "<p>" + slope_text(*fit, "estimated error") + ".</p>\n";
  if (const auto fit = fit_error(curve, true)) {
    html += "<p>" + slope_text(*fit, "error against the reference") + ".</p>\n";
  }
  if (const auto flat = flattening(curve)) {
    html +=
        "<p class=\"warning\">The error against the reference, " + short_number(flat->true_relmse) +
        ", is above what noise explains (97.5 % sure to be below " + short_number(flat->noise_high) +
        "). About " + short_number(flat->floor) +
        " of it does not fall with more samples: a bias of one of the two images, or noise in the reference. "
        "Chance alone does this once in 40.</p>\n";
  }
  const auto o = outlook(curve);
  if (!o) {
    return html +
           "<p>Not known yet what more time buys: the estimate takes two complete batches of 16 samples per "
           "pixel.</p>\n";
  }
  html += prediction_table(*o);
  const double minute = o->relmse * o->spp / (o->spp + 60 / o->seconds_per_spp);
  return html + "<p>Another minute takes the relMSE from " + short_number(o->relmse) + " to about " +
         short_number(minute) +
         ". Extrapolated by the 1/N law of independent samples at the pace of the second half; more workers "
         "are "
         "taken to be as fast as those of now.</p>\n";
}

}  // namespace lightmill
