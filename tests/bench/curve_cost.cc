// What recording the error curve costs: CPU seconds of folding into the batches and of the estimates at a
// job's points, over the CPU seconds of rendering the same samples, on one thread.
//
//   curve_cost SCENE --spp 256 [--integrator bdpt] [--resolution WxH]
//
// Prints one line of JSON: render_s, fold_s, estimate_s, points, and share = (fold_s + estimate_s) /
// render_s.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>

#include "common/error.h"
#include "common/image/checkpoints.h"
#include "common/image/error_curve.h"
#include "common/scene/load.h"
#include "worker/render/renderer.h"

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

int run(const std::string& path, const RenderOptions& options) {
  const SceneDescription scene = load_scene_file(path, {}, [](const Problem&) {});
  const RenderSettings settings = resolve_settings(scene, options);
  const Renderer renderer(scene, settings, 1);
  const auto workspace = renderer.make_workspace();
  BatchFilm batches(settings.grid);
  double rendering = 0, folding = 0, estimating = 0;
  int points = 0;
  for (int64_t begin = 0; begin < settings.spp;) {
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
      "{\"render_s\": %.4f, \"fold_s\": %.4f, \"estimate_s\": %.4f, \"points\": %d, \"share\": %.5f}\n",
      rendering, folding, estimating, points, (folding + estimating) / rendering);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Cost of recording the error curve");
  std::string scene, resolution;
  RenderOptions options;
  options.integrator = "pt";
  int64_t spp = 256;
  app.add_option("scene", scene)->required();
  app.add_option("--integrator", options.integrator)->check(CLI::IsMember({"pt", "bdpt", "lt"}));
  app.add_option("--spp", spp)->check(CLI::Range(1, 1 << 20));
  app.add_option("--resolution", resolution, "WxH");
  CLI11_PARSE(app, argc, argv);
  options.spp = spp;
  int width = 0, height = 0;
  if (!resolution.empty()) {
    if (std::sscanf(resolution.c_str(), "%dx%d", &width, &height) != 2) {
      std::fprintf(stderr, "curve_cost: --resolution takes WxH\n");
      return 2;
    }
    options.width = width;
    options.height = height;
  }
  try {
    return run(scene, options);
  } catch (const Error& e) {
    std::fprintf(stderr, "curve_cost: %s\n", e.what());
    return e.exit_code();
  }
}
