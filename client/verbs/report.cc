// lightmill report: error against run time, of a job or of a folder that `render --report` wrote; of several
// of them, on one chart with their efficiencies.
#include "common/error/report/report.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "client/cli.h"
#include "client/connection/farm_client.h"
#include "client/json_output.h"
#include "client/options.h"
#include "client/output.h"
#include "common/base/error.h"
#include "common/error/comparison.h"
#include "common/error/error_fit.h"
#include "common/error/report/report_files.h"

namespace lightmill::client {
namespace {

using Json = nlohmann::json;

struct ReportOptions {
  CommonOptions common;
  ConnectionOptions connection;
  std::vector<std::string> subjects;
  std::string output;
};

Json fit_json(const std::optional<ErrorFit>& fit) {
  if (!fit) return nullptr;
  return {{"slope", fit->slope},
          {"slope_low", fit->slope_low},
          {"slope_high", fit->slope_high},
          {"points", fit->points}};
}

/// The curve with what it says: slopes, flattening, outlook.
Json curve_document(const ErrorCurve& curve) {
  Json document = Json::parse(curve_to_json(curve));
  document["fit"] = fit_json(fit_error(curve, false));
  document["true_fit"] = fit_json(fit_error(curve, true));
  const auto flat = flattening(curve);
  document["flattening"] =
      flat
          ? Json{{"true_relmse", flat->true_relmse}, {"noise_high", flat->noise_high}, {"floor", flat->floor}}
          : Json(nullptr);
  const auto more = outlook(curve);
  document["seconds_to_half_error"] = more ? Json(more->seconds(2, 1)) : Json(nullptr);
  return document;
}

void print_fit(const char* what, const std::optional<ErrorFit>& fit) {
  if (!fit) return;
  std::printf("%s: slope %.3f (95 %%: %.3f to %.3f) against time\n", what, fit->slope, fit->slope_low,
              fit->slope_high);
}

/// A cell of a table, empty for what is not known.
std::string figure_cell(const std::optional<double>& value) {
  char text[32];
  if (!value) return std::string(13, ' ');
  std::snprintf(text, sizeof text, " %12.5g", *value);
  return text;
}

void print_curve(const ErrorCurve& curve) {
  std::printf("%10s %10s %10s %12s %25s", "wall s", "cpu s", "spp", "relMSE", "95 % interval");
  for (const int side : kBoxSides) std::printf(" %12s", ("of " + std::to_string(side) + " px").c_str());
  bool denoised = false;
  for (const ErrorPoint& p : curve.points) denoised |= p.denoised_relmse.has_value();
  if (denoised) std::printf(" %12s %25s", "denoised", "95 % interval");
  std::printf("\n");
  for (const ErrorPoint& p : curve.points) {
    std::string line = figure_cell(p.relmse) + figure_cell(p.relmse_low) + figure_cell(p.relmse_high);
    for (const BoxError& box : p.boxes) line += figure_cell(box.relmse);
    line += figure_cell(p.denoised_relmse) + figure_cell(p.denoised_relmse_low) +
            figure_cell(p.denoised_relmse_high);
    line.erase(line.find_last_not_of(' ') + 1);
    std::printf("%10.3f %10.3f %10.4g%s\n", p.wall_seconds, p.cpu_seconds, p.spp, line.c_str());
  }
  print_fit("estimated error", fit_error(curve, false));
  print_fit("error against the reference", fit_error(curve, true));
  if (const auto flat = flattening(curve)) {
    std::printf(
        "flattens: the error against the reference, %.4g, is above the %.4g that noise explains (1 in 40 by "
        "chance); about %.4g does not fall with more samples\n",
        flat->true_relmse, flat->noise_high, flat->floor);
  }
  if (const auto more = outlook(curve)) {
    std::printf("2x less error in another %.3g s, with twice the workers in %.3g s\n", more->seconds(2, 1),
                more->seconds(2, 2));
  }
}

void print_efficiencies(const std::vector<Efficiency>& rows) {
  std::printf("%-24s %10s %10s %10s %12s %14s  %s\n", "run", "spp", "wall s", "cpu s", "relMSE",
              "1/(relMSE*cpu)", "of the best (95 %)");
  for (const Efficiency& e : rows) {
    std::printf("%-24s %10.4g %10.3f %10.3f %12.5g %14.5g  %.3f", e.name.c_str(), e.point.spp,
                e.point.wall_seconds, e.point.cpu_seconds,
                e.of_truth ? *e.point.true_relmse : *e.point.relmse, e.per_cpu_second, e.relative);
    if (e.relative_low) std::printf(" (%.3f to %.3f)", *e.relative_low, *e.relative_high);
    std::printf("\n");
  }
}

Json efficiency_json(const Efficiency& e) {
  return {{"name", e.name},
          {"of_truth", e.of_truth},
          {"per_cpu_second", e.per_cpu_second},
          {"per_wall_second", e.per_wall_second},
          {"relative", e.relative},
          {"relative_low", e.relative_low ? Json(*e.relative_low) : Json(nullptr)},
          {"relative_high", e.relative_high ? Json(*e.relative_high) : Json(nullptr)}};
}

bool is_folder(const std::string& subject) { return std::filesystem::is_directory(subject); }

ErrorCurve read_folder(const std::string& subject) {
  const std::filesystem::path folder(subject);
  ErrorCurve curve = read_report_csv((folder / "error.csv").string());
  const std::filesystem::path whole = std::filesystem::weakly_canonical(folder);
  curve.job_name = (whole.has_filename() ? whole : whole.parent_path()).filename().string();
  return curve;
}

/// A folder that has error.csv: its plot is drawn again. A job: all of its report.
ErrorCurve report_one(const ReportOptions& options) {
  const std::string& subject = options.subjects.front();
  if (is_folder(subject)) {
    ErrorCurve curve = read_folder(subject);
    const std::string folder = options.output.empty() ? subject : options.output;
    make_report_folder(folder);
    write_report_file(folder, "error.svg", error_svg({curve}));
    return curve;
  }
  const JobId id{subject};
  FarmClient farm(options.connection);
  const JobStatus status = farm.job(id);
  ErrorCurve curve = farm.curve(id);
  const std::string folder = options.output.empty() ? "report-" + subject : options.output;
  write_report(folder, report_info(status, farm.pilot(id)), curve, farm.fetch(id).image);
  if (!options.common.quiet) std::fprintf(stderr, "wrote %s/report.html\n", folder.c_str());
  return curve;
}

std::vector<ErrorCurve> read_all(const ReportOptions& options) {
  std::unique_ptr<FarmClient> farm;
  std::vector<ErrorCurve> curves;
  std::multiset<std::string> names;
  for (const std::string& subject : options.subjects) {
    if (is_folder(subject)) {
      curves.push_back(read_folder(subject));
    } else {
      if (!farm) farm = std::make_unique<FarmClient>(options.connection);
      const JobId id{subject};
      curves.push_back(farm->curve(id));
      curves.back().job_name = subject + " " + curves.back().job_name;
    }
    names.insert(curves.back().job_name);
  }
  // Folders of the same name are told apart by their paths.
  for (size_t i = 0; i < curves.size(); ++i) {
    if (names.count(curves[i].job_name) > 1) curves[i].job_name = options.subjects[i];
  }
  return curves;
}

int report(const ReportOptions& options) {
  if (options.subjects.size() == 1) {
    const ErrorCurve curve = report_one(options);
    if (options.common.json) {
      std::printf("%s\n", dump(curve_document(curve)).c_str());
    } else {
      print_curve(curve);
    }
    return 0;
  }
  const std::vector<ErrorCurve> curves = read_all(options);
  const std::string folder = options.output.empty() ? "report-comparison" : options.output;
  write_comparison(folder, curves);
  const std::vector<Efficiency> rows = efficiencies(curves);
  if (options.common.json) {
    Json document = {{"runs", Json::array()}, {"efficiency", Json::array()}};
    for (const ErrorCurve& curve : curves) document["runs"].push_back(curve_document(curve));
    for (const Efficiency& e : rows) document["efficiency"].push_back(efficiency_json(e));
    std::printf("%s\n", dump(document).c_str());
  } else {
    print_efficiencies(rows);
  }
  if (!options.common.quiet) std::fprintf(stderr, "wrote %s/report.html\n", folder.c_str());
  return 0;
}

}  // namespace

void add_report(CLI::App& app, Action& action) {
  auto options = std::make_shared<ReportOptions>();
  CLI::App* verb =
      add_verb(app, "report", "Error against run time: error.csv, error.svg, report.html", &options->common);
  add_json(verb, &options->common);
  add_connection(verb, &options->connection);
  verb->add_option("JOB|DIR", options->subjects,
                   "A job's id, or a folder that has error.csv; several are drawn on one chart and compared")
      ->required();
  verb->add_option("-o,--output", options->output,
                   "Folder to write to (default: report-JOB, DIR, or report-comparison)");
  verb->callback([&action, options] { action = [options] { return report(*options); }; });
}

}  // namespace lightmill::client
