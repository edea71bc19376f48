// extreme_suite: the stiff and extreme cases, a row each; exit code 1 if one fails.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>

#include "common/base/error.h"
#include "tests/extreme/matrix.h"
#include "tests/extreme/report.h"

namespace lightmill::test {
namespace {

std::vector<Case> all_cases() {
  std::vector<Case> all;
  for (const auto& family : {enclosure_cases, specular_cases, direct_light_cases, near_light_cases,
                             range_cases, contact_cases, odd_cases, identity_cases, media_cases}) {
    for (Case& c : family()) all.push_back(std::move(c));
  }
  return all;
}

void write_file(const std::string& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  if (!(file << content << std::flush)) throw Error(ErrorKind::kFailed, path + ": can't be written");
}

/// Prints the matrices; false if estimators differ.
bool run_matrices(const SuiteOptions& options, bool list) {
  bool passed = true;
  const std::vector<std::string> names = matrix_scenes();
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i].find(options.filter) == std::string::npos) continue;
    if (list) {
      std::printf("%s\n", names[i].c_str());
      continue;
    }
    const AgreementMatrix m = agreement_matrix(i, options.full);
    std::printf("%s", matrix_text(m).c_str());
    std::fflush(stdout);
    passed = passed && m.passed();
  }
  return passed;
}

int run(int argc, char** argv) {
  CLI::App app{"Renders scenes whose answer is known, at the ends of their ranges; a row each"};
  SuiteOptions options;
  std::string json, html;
  bool list = false, matrix = false;
  app.add_flag("--full", options.full, "Every set of strategies of every case, and more samples");
  app.add_option("--filter", options.filter,
                 "Only rows whose \"case, parameter [strategies]\" contains this");
  app.add_flag("--list", list, "Print the rows' names only");
  app.add_flag("--matrix", matrix,
               "In place of the cases: z values of all pairs of estimators on ten scenes");
  app.add_option("--json", json, "Write the rows to this file");
  app.add_option("--html", html, "Write a page with pictures to this file");
  CLI11_PARSE(app, argc, argv);

  if (matrix) return run_matrices(options, list) ? 0 : 1;
  const std::vector<Case> cases = all_cases();
  std::vector<Row> rows;
  if (!list) std::printf("%s\n", text_head().c_str());
  for (const Case& c : cases) {
    for (const Run& r : runs_of(c, options)) {
      if (list) {
        std::printf("%s\n", row_title(c, r).c_str());
        continue;
      }
      rows.push_back(run_case(c, r, options));
      std::printf("%s\n", text_row(rows.back()).c_str());
      std::fflush(stdout);
    }
  }
  if (list) return 0;
  std::printf("%s\n", text_summary(rows).c_str());
  if (!json.empty()) write_file(json, json_report(rows));
  if (!html.empty()) write_file(html, html_report(rows));
  const bool failed =
      std::any_of(rows.begin(), rows.end(), [](const Row& row) { return row.verdict == Verdict::kFail; });
  return failed || rows.empty() ? 1 : 0;
}

}  // namespace
}  // namespace lightmill::test

int main(int argc, char** argv) {
  try {
    return lightmill::test::run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "extreme_suite: %s\n", e.what());
    return 1;
  }
}
