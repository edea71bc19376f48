#include "tests/bench/render/bench_scene.h"

#include <algorithm>
#include <cstdio>
#include <thread>

#include "common/base/error.h"
#include "common/base/parallel.h"
#include "common/scene/load.h"
#include "worker/render/plan/pilot.h"

namespace lightmill::bench {

void add_options(CLI::App& app, Options* options) {
  app.add_option("scene", options->scene)->required();
  app.add_option("--integrator", options->render.integrator);
  app.add_option("--spp", options->spp)->check(CLI::Range(1, 1 << 20));
  app.add_option("--threads", options->threads)->check(CLI::Range(0, 1024));
  app.add_option("--resolution", options->resolution, "WxH");
  app.add_option("--plan-override", options->render.overrides);
}

double Scene::samples() const {
  return static_cast<double>(settings.grid.crop.area()) * static_cast<double>(settings.spp);
}

std::vector<Packet> Scene::packets() const {
  const CellRect cells = settings.grid.cells();
  std::vector<Packet> packets;
  for (int64_t b = 0; b < block_count(settings.spp); ++b) {
    for (int y = cells.y0; y < cells.y1; ++y) {
      for (int x = cells.x0; x < cells.x1; ++x)
        packets.push_back({x, y, block_begin(b), std::min(block_end(b), settings.spp)});
    }
  }
  return packets;
}

PartialBuilder Scene::builder() const {
  return {settings.grid,
          {settings.grid.cells(), 0, settings.spp},
          renderer->quantum_exponent(),
          renderer->has_camera_layer(),
          renderer->has_splat_layer()};
}

RenderOptions render_options(const Options& options) {
  RenderOptions render = options.render;
  render.spp = options.spp;
  if (!options.resolution.empty()) {
    int width = 0, height = 0;
    if (std::sscanf(options.resolution.c_str(), "%dx%d", &width, &height) != 2)
      throw Error(ErrorKind::kUsage, "--resolution takes WxH");
    render.width = width;
    render.height = height;
  }
  return render;
}

Scene build(const Options& options) {
  Scene out;
  SceneDescription scene;
  out.load_s = seconds_of(
      [&] { scene = load_scene_file(options.scene, {.threads = options.threads}, [](const Problem&) {}); });
  out.settings = resolve_settings(scene, render_options(options));
  std::unique_ptr<Renderer> built;
  out.build_s = seconds_of(
      [&] { built = std::make_unique<Renderer>(std::move(scene), out.settings, options.threads); });
  out.pilot_s = seconds_of([&] {
    if (!needs_pilot(out.settings)) return;
    out.settings.plan = run_pilot(*built, thread_count(options.threads), [] { return true; }).chosen;
  });
  out.renderer = std::make_unique<Renderer>(*built, out.settings);
  return out;
}

int run_main(CLI::App& app, int argc, char** argv, const std::function<void()>& work) {
  CLI11_PARSE(app, argc, argv);
  try {
    work();
    return 0;
  } catch (const Error& e) {
    std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), e.what());
    return e.exit_code();
  }
}

}  // namespace lightmill::bench
