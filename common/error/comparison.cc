#include "common/error/comparison.h"

#include <algorithm>
#include <cmath>

#include "common/error/confidence.h"
#include "common/error/error_fit.h"
#include "common/error/report/report.h"
#include "common/error/report/report_files.h"
#include "common/error/report/report_text.h"

namespace lightmill {

namespace {

const std::optional<double>& error_of(const ErrorPoint& p, bool of_truth) {
  return of_truth ? p.true_relmse : p.relmse;
}

/// The last point that has the error and took time; null if there is none.
const ErrorPoint* last_point(const ErrorCurve& run, bool of_truth) {
  for (auto p = run.points.rbegin(); p != run.points.rend(); ++p) {
    const std::optional<double>& error = error_of(*p, of_truth);
    if (error && *error > 0 && p->cpu_seconds > 0 && p->wall_seconds > 0) return &*p;
  }
  return nullptr;
}

std::string table(const std::vector<Efficiency>& rows) {
  std::string html =
      "<table>\n<tr><th>run</th><th>spp</th><th>wall</th><th>CPU</th><th>relMSE</th>"
      "<th>1/(relMSE·CPU s)</th><th>1/(relMSE·wall s)</th><th>of the best</th></tr>\n";
  for (const Efficiency& e : rows) {
    std::string relative = short_number(e.relative);
    if (e.relative_low) {
      relative += " (95 %: " + short_number(*e.relative_low) + " to " + short_number(*e.relative_high) + ")";
    }
    html += "<tr><td>" + escape_markup(e.name) + "</td><td>" + short_number(e.point.spp, 6) + "</td><td>" +
            short_duration(e.point.wall_seconds) + "</td><td>" + short_duration(e.point.cpu_seconds) +
            "</td><td>" + short_number(*error_of(e.point, e.of_truth)) + "</td><td>" +
            short_number(e.per_cpu_second) + "</td><td>" + short_number(e.per_wall_second) + "</td><td>" +
            relative + "</td></tr>\n";
  }
  return html + "</table>\n";
}

}  // namespace

std::vector<Efficiency> efficiencies(const std::vector<ErrorCurve>& runs) {
  const bool of_truth = std::all_of(runs.begin(), runs.end(), [](const ErrorCurve& run) {
    return last_point(run, true) || !last_point(run, false);
  });
  std::vector<Efficiency> rows;
  double best = 0;
  std::optional<double> best_deviation;
  for (const ErrorCurve& run : runs) {
    const ErrorPoint* p = last_point(run, of_truth);
    if (!p) continue;
    Efficiency e;
    e.name = run.job_name;
    e.point = *p;
    e.of_truth = of_truth;
    e.per_cpu_second = 1 / (*error_of(*p, of_truth) * p->cpu_seconds);
    e.per_wall_second = 1 / (*error_of(*p, of_truth) * p->wall_seconds);
    rows.push_back(e);
    if (e.per_cpu_second <= best) continue;
    best = e.per_cpu_second;
    best_deviation = relative_deviation(*p);
  }
  for (Efficiency& e : rows) {
    e.relative = e.per_cpu_second / best;
    const std::optional<double> deviation = relative_deviation(e.point);
    if (!deviation || !best_deviation || e.per_cpu_second == best) continue;
    const double factor = std::exp(kNormal975 * std::hypot(*deviation, *best_deviation));
    e.relative_low = e.relative / factor;
    e.relative_high = e.relative * factor;
  }
  return rows;
}

void write_comparison(const std::string& folder, const std::vector<ErrorCurve>& runs) {
  make_report_folder(folder);
  std::string csv, curves;
  for (const ErrorCurve& run : runs) {
    const std::string rows = error_csv(run);
    const size_t header = rows.find('\n') + 1;
    if (csv.empty()) csv = "run," + rows.substr(0, header);
    for (size_t begin = header; begin < rows.size();) {
      const size_t end = rows.find('\n', begin) + 1;
      csv += csv_cell(run.job_name) + "," + rows.substr(begin, end - begin);
      begin = end;
    }
  }
  for (const ErrorCurve& run : runs) {
    curves += "<h3>" + escape_markup(run.job_name) + "</h3>\n" + curve_statements(run);
  }
  const std::string svg = error_svg(runs);
  std::string html = html_head("Error against run time of " + std::to_string(runs.size()) + " runs");
  html +=
      "<figure>" + svg +
      "<figcaption>relMSE = mean of (I−R)²/(R²+0.01) over pixels and channels. Only runs of the same picture "
      "(scene, size, crop) can be compared.</figcaption></figure>\n";
  html += "<h2>Efficiency</h2>\n" + table(efficiencies(runs));
  html += "<h2>Each run</h2>\n" + curves + "</body>\n</html>\n";
  write_report_file(folder, "error.csv", csv);
  write_report_file(folder, "error.svg", svg);
  write_report_file(folder, "report.html", html);
}

}  // namespace lightmill
