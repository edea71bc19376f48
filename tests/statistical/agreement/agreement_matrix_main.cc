// agreement_matrix: strategies and integrators against each other; exit code 1 if two of them differ, or if
// the comparison would notice no error of an estimator.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "common/base/error.h"
#include "tests/statistical/agreement/agreement_matrix.h"

namespace lightmill::test {
namespace {

/// An estimator that is this much too bright must be found out, by the best of the others.
constexpr double kMustNotice = 1.5;

void write_file(const std::string& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  if (!(file << content << std::flush)) throw Error(ErrorKind::kFailed, path + ": can't be written");
}

bool agrees(const Matrix& m, double allowed) {
  for (const auto& row : m.cells) {
    for (const Cell& cell : row) {
      if (!(std::fabs(cell.z) <= allowed)) return false;
    }
  }
  return true;
}

/// Whether a comparison with any estimator made kMustNotice times as bright fails; if not, its name is
/// printed.
bool notices_all(const PathLength& length, double level, double allowed) {
  bool all = true;
  for (size_t i = 0; i < length.estimators.size(); ++i) {
    if (!agrees(compare(scaled(length, i, kMustNotice), level), allowed)) continue;
    std::printf("  %d vertices: nothing would notice that %s is %g times too bright\n", length.vertices,
                length.estimators[i].name.c_str(), kMustNotice);
    all = false;
  }
  return all;
}

int run(int argc, char** argv) {
  CLI::App app{
      "Compares every (s,t) alone, pt, lt and bdpt with each other on small scenes, per path length"};
  int64_t spp = 256;
  std::string filter, json, html;
  bool list = false;
  app.add_option("--spp", spp, "Samples per pixel of each of the 16 batches")
      ->check(CLI::Range(int64_t{16}, int64_t{1} << 20))
      ->capture_default_str();
  app.add_option("--filter", filter, "Only scenes whose name contains this");
  app.add_flag("--list", list, "Print the scenes' names only");
  app.add_option("--json", json, "Write the matrices to this file");
  app.add_option("--html", html, "Write a page with pictures to this file");
  CLI11_PARSE(app, argc, argv);

  std::vector<SceneEstimates> scenes;
  int64_t tests = 0;
  for (const MatrixScene& scene : matrix_scenes()) {
    if (scene.name.find(filter) == std::string::npos) continue;
    if (list) {
      std::printf("%s\n", scene.name.c_str());
      continue;
    }
    scenes.push_back(estimate_scene(scene, spp));
    for (const PathLength& length : scenes.back().lengths) tests += tests_in(length);
  }
  if (list) return 0;
  if (scenes.empty()) throw Error(ErrorKind::kUsage, "--filter " + filter + ": no scene is named so");
  const double level = kFamilyAlpha / static_cast<double>(tests), allowed = largest_z(level);
  int failed = 0;
  for (const SceneEstimates& s : scenes) {
    bool passed = s.nonfinite == 0;
    std::string text;
    for (const PathLength& length : s.lengths) {
      const Matrix m = compare(length, level);
      passed = agrees(m, allowed) && passed;
      passed = notices_all(length, level, allowed) && passed;
      text += matrix_text(length, m, allowed);
    }
    std::printf("%s: %llu non-finite, %s\n%s", s.scene.name.c_str(),
                static_cast<unsigned long long>(s.nonfinite), passed ? "pass" : "FAIL", text.c_str());
    failed += passed ? 0 : 1;
  }
  std::printf("%zu scenes, %lld tests, |z| up to %.2f allowed: %d FAIL\n", scenes.size(),
              static_cast<long long>(tests), allowed, failed);
  if (!json.empty()) write_file(json, matrix_json(scenes, level));
  if (!html.empty()) write_file(html, matrix_html(scenes, level));
  return failed > 0 ? 1 : 0;
}

}  // namespace
}  // namespace lightmill::test

int main(int argc, char** argv) {
  try {
    return lightmill::test::run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "agreement_matrix: %s\n", e.what());
    return 1;
  }
}
