// Measures whether error estimates keep their promises: the coverage of the 95 % interval at every
// checkpoint, and what becomes of --target-error, on six small scenes.
//
//   error_coverage [--all] [--scene NAME] [--runs N] [--side PIXELS] [--superblocks N] [--needed N]
//   [--first-seed N] [--threads N] [--gaussian]
//
// --all: 200 runs of 24 x 24 pixels and 40 superblocks a scene (about 6 minutes of CPU). Prints a table; exit
// code 1 if a bar is missed: an interval holds the true error in 90 % of the runs at least at every
// checkpoint, and a job stops with a true error below its target in 93 % (over the scenes together), with at
// most 1.5 times the samples in the median of every scene.
#include "tests/statistical/error/error_coverage.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <thread>

int main(int argc, char** argv) {
  using namespace lightmill::test;
  CLI::App app("Coverage of error estimates");
  bool all = false, gaussian = false;
  int runs = 40, side = 24, threads = static_cast<int>(std::thread::hardware_concurrency());
  int64_t superblocks = 27, needed = 12;
  uint64_t first_seed = 1000;
  std::string only;
  app.add_flag("--all", all);
  app.add_option("--scene", only);
  app.add_option("--runs", runs)->check(CLI::Range(3, 100000));
  app.add_option("--side", side)->check(CLI::Range(1, 4096));
  app.add_option("--superblocks", superblocks)->check(CLI::Range(4, 4096));
  app.add_option("--needed", needed, "superblocks that the stop rule's target takes")
      ->check(CLI::Range(1, 4096));
  app.add_option("--first-seed", first_seed, "of the runs' seeds, which follow each other");
  app.add_flag("--gaussian", gaussian, "pbrt's default pixel filter, not a box of one pixel");
  app.add_option("--threads", threads)->check(CLI::Range(1, 1024));
  CLI11_PARSE(app, argc, argv);
  if (all) {
    runs = 200;
    superblocks = 40;
  }
  needed = std::min(needed, superblocks);
  bool good = true;
  int total = 0, kept = 0;
  std::vector<double> medians;
  for (const ErrorScene& scene : error_scenes(side, gaussian)) {
    if (!only.empty() && scene.name != only) continue;
    const CoverageResult result = measure_coverage(scene, runs, superblocks, needed, threads, first_seed);
    std::printf(
        "%s: of pixels, and of boxes of 4, 16 and 32\n  batches    spp  (covered    bias  half-width)\n",
        scene.name.c_str());
    for (const CheckpointCoverage& c : result.checkpoints) {
      if (c.pixels.runs == 0) continue;
      std::printf("  %7d %6lld", c.batches, static_cast<long long>(c.spp));
      const auto print = [&](const Coverage& of) {
        if (of.runs == 0) return;
        const double share = static_cast<double>(of.covered) / of.runs;
        good = good && share >= 0.9;
        std::printf("   %5.1f %%  %+6.3f  %6.3f", 100 * share, of.bias, of.width);
      };
      print(c.pixels);
      for (const Coverage& boxes : c.boxes) print(boxes);
      std::printf("\n");
    }
    const StopRule& s = result.stop;
    std::printf(
        "  target %.3g: kept in %d of %d runs, %.2f x the samples needed in the median, %d never met\n",
        s.target, s.kept, s.runs, s.median_samples, s.unfinished);
    std::fflush(stdout);
    total += s.runs;
    kept += s.kept;
    medians.push_back(s.median_samples);
  }
  if (medians.empty()) {
    std::fprintf(stderr, "error_coverage: no scene \"%s\"\n", only.c_str());
    return 2;
  }
  const double share = static_cast<double>(kept) / total,
               most = *std::max_element(medians.begin(), medians.end());
  good = good && share >= 0.93 && most <= 1.5;
  std::printf("targets kept in %.1f %%, at most %.2f x the samples needed in a scene's median: %s\n",
              100 * share, most, good ? "the bars are met" : "A BAR IS MISSED");
  return good ? 0 : 1;
}
