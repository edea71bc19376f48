// lightmill report: error against run time, of a job or of a folder that `render --report` wrote.
#include "common/image/report.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli.h"
#include "client/farm_client.h"
#include "client/json_output.h"
#include "client/options.h"
#include "common/error.h"

namespace lightmill::client {
namespace {

struct ReportOptions {
  CommonOptions common;
  ConnectionOptions connection;
  std::string subject, output;
};

void print_curve(const ErrorCurve& curve, bool json) {
  if (json) {
    std::printf("%s\n", dump(nlohmann::json::parse(curve_to_json(curve))).c_str());
    return;
  }
  std::printf("%10s %10s %10s %12s %25s\n", "wall s", "cpu s", "spp", "relMSE", "95 % interval");
  for (const ErrorPoint& p : curve.points) {
    std::printf("%10.3f %10.3f %10.4g", p.wall_seconds, p.cpu_seconds, p.spp);
    if (p.relmse) std::printf(" %12.5g", *p.relmse);
    if (p.relmse_low && p.relmse_high) std::printf(" %12.5g %12.5g", *p.relmse_low, *p.relmse_high);
    std::printf("\n");
  }
}

/// A folder that has error.csv: its plot is drawn again.
int report_folder(const ReportOptions& options) {
  const std::filesystem::path folder(options.subject);
  const ErrorCurve curve = read_report_csv((folder / "error.csv").string());
  const std::string path = (folder / "error.svg").string();
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << error_svg(curve);
  out.close();
  if (!out) throw Error(ErrorKind::kFailed, path + ": cannot be written; check the folder's permissions");
  print_curve(curve, options.common.json);
  return 0;
}

int report(const ReportOptions& options) {
  if (std::filesystem::is_directory(options.subject)) return report_folder(options);
  const JobId id{options.subject};
  FarmClient farm(options.connection);
  const JobStatus status = farm.job(id);
  const ErrorCurve curve = farm.curve(id);
  const std::string folder = options.output.empty() ? "report-" + options.subject : options.output;
  write_report(folder, {status.name, settings_to_json(status.settings), status.counters}, curve,
               farm.fetch(id).image);
  print_curve(curve, options.common.json);
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
  verb->add_option("JOB|DIR", options->subject, "A job's id, or a folder that has error.csv")->required();
  verb->add_option("-o,--output", options->output, "Folder to write a job's report to (default: report-JOB)");
  verb->callback([&action, options] { action = [options] { return report(*options); }; });
}

}  // namespace lightmill::client
