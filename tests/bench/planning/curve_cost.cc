// What recording the error curve costs: CPU seconds of folding into the batches and of the estimates at a
// job's points, over the CPU seconds of rendering the same samples, on one thread. Tiles are rows of cells:
// at 1280x720 about as large as those of a local render, and folded while they are in the caches, as there.
//
//   curve_cost SCENE --spp 256 [--seconds S] [--integrator bdpt] [--resolution WxH]
//
// Ends after --spp samples per pixel, or when rendering has taken S CPU seconds. Points get further apart as
// a job goes on, so the longer it runs, the smaller the share. Prints one line of JSON: spp, render_s,
// fold_s, estimate_s, points, and share = (fold_s + estimate_s) / render_s.
#include <cstdio>
#include <ctime>
#include <limits>

#include "common/error/batch_film.h"
#include "common/error/checkpoints.h"
#include "tests/bench/render/bench_scene.h"

namespace {

using namespace lightmill;

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Partial render(const Renderer& renderer, Workspace& workspace, const TileSpec& tile) {
  PartialBuilder builder(renderer.settings().grid, tile, renderer.quantum_exponent(),
                         renderer.has_camera_layer(), renderer.has_splat_layer());
  for (int64_t b = block_of_sample(tile.sample_begin); block_begin(b) < tile.sample_end; ++b) {
    for (int y = tile.cells.y0; y < tile.cells.y1; ++y) {
      for (int x = tile.cells.x0; x < tile.cells.x1; ++x) {
        renderer.render_packet({x, y, block_begin(b), std::min(block_end(b), tile.sample_end)}, workspace,
                               builder);
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
    for (CellRect row = settings.grid.cells(); row.y0 < settings.grid.cells().y1; ++row.y0) {
      row.y1 = row.y0 + 1;
      const Partial partial = render(renderer, *workspace, {row, begin, end});
      lap(&rendering);
      batches.fold(partial);
      lap(&folding);
    }
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
