// What recording the error curve costs: CPU seconds of folding into the batches and of the estimates at a
// job's points, over the CPU seconds of rendering the same samples, on one thread.
//
//   curve_cost SCENE --spp 256 [--seconds S] [--integrator bdpt] [--resolution WxH]
//
// Ends after --spp samples per pixel, or when rendering has taken S CPU seconds. Points get further apart as
// a job goes on, so the longer it runs, the smaller the share. Prints one line of JSON: spp, render_s,
// fold_s, estimate_s, points, and share = (fold_s + estimate_s) / render_s.
#include <cstdio>
#include <ctime>
#include <limits>

#include "common/image/checkpoints.h"
#include "common/image/error_curve.h"
#include "tests/bench/bench_scene.h"

namespace {

using namespace lightmill;

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Partial render(const Renderer& renderer, Workspace& workspace, int64_t begin, int64_t end) {
  const CellRect cells = renderer.settings().grid.cells();
  PartialBuilder builder(renderer.settings().grid, {cells, begin, end}, renderer.quantum_exponent(),
                         renderer.has_camera_layer(), renderer.has_splat_layer());
  for (int64_t b = block_of_sample(begin); block_begin(b) < end; ++b) {
    for (int y = cells.y0; y < cells.y1; ++y) {
      for (int x = cells.x0; x < cells.x1; ++x) {
        renderer.render_packet({x, y, block_begin(b), std::min(block_end(b), end)}, workspace, builder);
      }
    }
  }
  return builder.take();
}

void measure(const bench::Options& options, double seconds) {
  const bench::Scene scene = bench::build(options);
  const Renderer& renderer = *scene.renderer;
  const RenderSettings& settings = scene.settings;
  const auto workspace = renderer.make_workspace();
  BatchFilm batches(settings.grid);
  double rendering = 0, folding = 0, estimating = 0;
  int points = 0;
  int64_t begin = 0;
  while (begin < settings.spp && rendering < seconds) {
    const int64_t end = std::min(begin + kSuperblockSamples, settings.spp);
    double t = cpu_seconds();
    const auto lap = [&](double* sum) {
      const double now = cpu_seconds();
      *sum += now - t;
      t = now;
    };
    const Partial partial = render(renderer, *workspace, begin, end);
    lap(&rendering);
    batches.fold(partial);
    lap(&folding);
    if (next_checkpoint(end - 1) == end || end == settings.spp) {
      ErrorPoint point;
      batches.estimate(&point);
      ++points;
      lap(&estimating);
    }
    begin = end;
  }
  std::printf(
      "{\"spp\": %lld, \"render_s\": %.4f, \"fold_s\": %.4f, \"estimate_s\": %.4f, \"points\": %d, "
      "\"share\": %.5f}\n",
      static_cast<long long>(begin), rendering, folding, estimating, points,
      (folding + estimating) / rendering);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Cost of recording the error curve");
  bench::Options options;
  double seconds = std::numeric_limits<double>::infinity();
  options.render.integrator = "pt";
  options.spp = 256;
  options.threads = 1;
  bench::add_options(app, &options);
  app.add_option("--seconds", seconds)->check(CLI::PositiveNumber);
  return bench::run_main(app, argc, argv, [&] { measure(options, seconds); });
}
