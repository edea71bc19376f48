// extreme_suite: the stiff and extreme cases, a row each; exit code 1 if one fails.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>

#include "common/base/error.h"
#include "tests/extreme/matrix.h"
#include "tests/extreme/random/random_cases.h"
#include "tests/extreme/report.h"

namespace lightmill::test {
namespace {

std::vector<Case> all_cases() {
  std::vector<Case> all;
  for (const auto& family :
       {enclosure_cases, specular_cases, direct_light_cases, near_light_cases, range_cases, contact_cases,
        coincident_cases, odd_cases, identity_cases, media_cases, own_light_cases, volume_cases}) {
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

/// What is to be run: cases, and the strategies of each.
struct Rows {
  std::vector<Case> cases;
  std::vector<std::vector<Run>> runs;
};

Rows fixed_rows(const SuiteOptions& options) {
  Rows rows{all_cases(), {}};
  for (const Case& c : rows.cases) rows.runs.push_back(runs_of(c, options));
  return rows;
}

Rows random_rows(uint64_t seed, int first, int count, SuiteOptions* options) {
  Rows rows{random_cases(seed, first, count), {}};
  size_t total = 0;
  for (const Case& c : rows.cases) {
    std::vector<Run>& runs = rows.runs.emplace_back(random_runs(c));
    total += runs.size();
    std::erase_if(runs,
                  [&](const Run& r) { return row_title(c, r).find(options->filter) == std::string::npos; });
  }
  options->largest_z = largest_z(total);
  options->noisy_fails = false;
  return rows;
}

int run(int argc, char** argv) {
  CLI::App app{"Renders scenes whose answer is known, at the ends of their ranges; a row each"};
  SuiteOptions options;
  std::string json, html;
  bool list = false, matrix = false;
  int random = 0, first = 0;
  uint64_t seed = 1;
  app.add_flag("--full", options.full, "Every set of strategies of every case, and more samples");
  app.add_option("--filter", options.filter,
                 "Only rows whose \"case, parameter [strategies]\" contains this");
  app.add_flag("--list", list, "Print the rows' names only");
  app.add_flag("--matrix", matrix,
               "In place of the cases: z values of all pairs of estimators on ten scenes");
  app.add_option("--random", random, "In place of the cases: this many scenes that are drawn")
      ->check(CLI::Range(1, 1000000));
  app.add_option("--seed", seed, "Of the drawn scenes");
  app.add_option("--first", first, "Number of the first drawn scene")->check(CLI::Range(0, 1000000));
  app.add_option("--json", json, "Write the rows to this file");
  app.add_option("--html", html, "Write a page with pictures to this file");
  CLI11_PARSE(app, argc, argv);

  if (matrix) return run_matrices(options, list) ? 0 : 1;
  const Rows all = random > 0 ? random_rows(seed, first, random, &options) : fixed_rows(options);
  std::vector<Row> rows;
  if (!list) std::printf("%s\n", text_head().c_str());
  for (size_t i = 0; i < all.cases.size(); ++i) {
    for (const Run& r : all.runs[i]) {
      if (list) {
        std::printf("%s\n", row_title(all.cases[i], r).c_str());
        continue;
      }
      rows.push_back(run_case(all.cases[i], r, options));
      std::printf("%s\n", text_row(rows.back()).c_str());
      std::fflush(stdout);
    }
  }
  if (list) return 0;
  std::printf("%s; |z| up to %.2f passes\n", text_summary(rows).c_str(), options.largest_z);
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
