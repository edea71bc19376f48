// What planning costs: CPU seconds of finding out what the scene does not need, and of the pilot of `auto`,
// beside those of reading and building it, on one thread.
//
//   plan_cost SCENE [--resolution WxH] [--runs N]
//
// Prints one line of JSON: load_s (reading), build_s (tables, arrays and tree), plan_s (median of the runs:
// constants folded, what is in use, the scene analysed), plan_share = plan_s / (load_s + build_s), pilot_s.
#include <algorithm>
#include <cstdio>
#include <ctime>

#include "common/scene/fold_constants.h"
#include "common/scene/load.h"
#include "common/scene/parts_in_use.h"
#include "common/scene/resolve_settings.h"
#include "tests/bench/render/bench_scene.h"
#include "worker/render/plan/pilot.h"

namespace {

using namespace lightmill;

/// CPU seconds of all threads: Embree has its own.
template <class Work>
double cpu_seconds_of(const Work& work) {
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  };
  const double start = now();
  work();
  return now() - start;
}

void measure(const bench::Options& options, int runs) {
  SceneDescription scene;
  const double load_s =
      cpu_seconds_of([&] { scene = load_scene_file(options.scene, {}, [](const Problem&) {}); });
  std::vector<double> planned(static_cast<size_t>(runs));
  for (double& seconds : planned) {
    seconds = cpu_seconds_of([&] {
      fold_constants(&scene);
      parts_in_use(scene);
    });
  }
  const RenderSettings settings = resolve_settings(scene, bench::render_options(options));
  std::unique_ptr<Renderer> renderer;
  const double build_s =
      cpu_seconds_of([&] { renderer = std::make_unique<Renderer>(std::move(scene), settings, 1); });
  for (double& seconds : planned) {
    seconds += cpu_seconds_of([&] { const Renderer same_world_analysed_anew(*renderer, settings); });
  }
  const double pilot_s = cpu_seconds_of([&] { run_pilot(*renderer, 1, [] { return true; }); });
  const auto median = planned.begin() + runs / 2;
  std::nth_element(planned.begin(), median, planned.end());
  std::printf(
      "{\"load_s\": %.5f, \"build_s\": %.5f, \"plan_s\": %.7f, \"plan_share\": %.7f, \"pilot_s\": %.4f}\n",
      load_s, build_s, *median, *median / (load_s + build_s), pilot_s);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Cost of planning");
  bench::Options options;
  int runs = 5;
  bench::add_options(app, &options);
  app.add_option("--runs", runs)->check(CLI::Range(1, 1000));
  return bench::run_main(app, argc, argv, [&] { measure(options, runs); });
}
