// Renders a scene with the bare renderer (no farm, no commits, no fold) and prints one line of JSON.
//
//   bench_render SCENE --integrator bdpt --spp 16 [--resolution WxH] [--threads N]
//
// load_s: reading the scene; build_s: textures, normalisation, acceleration structure; pilot_s: choosing the
// sampling plan (auto, the default, only); render_s: wall time of the packets; cpu_s: of the render threads;
// peak_gb: resident set.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "common/error.h"
#include "common/scene/load.h"
#include "common/settings.h"
#include "worker/render/plan/pilot.h"
#include "worker/render/renderer.h"

namespace {

using lightmill::Packet;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int run(const std::string& path, const lightmill::RenderOptions& options, int threads) {
  const auto t0 = std::chrono::steady_clock::now();
  auto scene = lightmill::load_scene_file(path, {}, [](const lightmill::Problem&) {});
  auto settings = lightmill::resolve_settings(scene, options);
  const double load = seconds_since(t0);
  const auto t1 = std::chrono::steady_clock::now();
  const lightmill::Renderer built(std::move(scene), settings, threads);
  const double build = seconds_since(t1);
  const auto t_pilot = std::chrono::steady_clock::now();
  if (needs_pilot(settings)) settings.plan = run_pilot(built, threads, [] { return true; }).chosen;
  const double pilot = seconds_since(t_pilot);
  const lightmill::Renderer renderer(built, settings);

  const lightmill::CellRect cells = settings.grid.cells();
  std::vector<Packet> packets;
  for (int64_t b = 0; b < lightmill::block_count(settings.spp); ++b) {
    for (int y = cells.y0; y < cells.y1; ++y) {
      for (int x = cells.x0; x < cells.x1; ++x) {
        packets.push_back({x, y, lightmill::block_begin(b), std::min(lightmill::block_end(b), settings.spp)});
      }
    }
  }
  lightmill::PartialBuilder builder(settings.grid, {cells, 0, settings.spp}, renderer.quantum_exponent(),
                                    renderer.has_camera_layer(), renderer.has_splat_layer());
  const auto t2 = std::chrono::steady_clock::now();
  std::atomic<size_t> next{0};
  std::vector<std::thread> pool;
  for (int t = 0; t < threads; ++t) {
    pool.emplace_back([&] {
      const auto workspace = renderer.make_workspace();
      for (size_t i; (i = next++) < packets.size();) renderer.render_packet(packets[i], *workspace, builder);
    });
  }
  for (auto& t : pool) t.join();
  const double render = seconds_since(t2);
  const lightmill::Partial partial = builder.take();
  const auto& c = partial.counters;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const double samples = static_cast<double>(settings.grid.crop.area()) * static_cast<double>(settings.spp);
  const auto per_sample = [&](uint64_t n) { return static_cast<double>(n) / samples; };
  std::printf(
      "{\"load_s\": %.3f, \"build_s\": %.3f, \"pilot_s\": %.3f, \"render_s\": %.3f, \"cpu_s\": %.3f, "
      "\"msamples_per_s\": %.4f, "
      "\"closest_rays_per_sample\": %.3f, \"shadow_rays_per_sample\": %.3f, \"zero_skipped_per_sample\": "
      "%.3f, "
      "\"rouletted_per_sample\": %.3f, \"nonfinite\": %llu, \"peak_gb\": %.3f}\n",
      load, build, pilot, render, partial.cpu_seconds, samples / render * 1e-6,
      per_sample(c.closest_hit_rays), per_sample(c.shadow_rays), per_sample(c.zero_connections_skipped),
      per_sample(c.rouletted_connections), static_cast<unsigned long long>(c.nonfinite),
      static_cast<double>(usage.ru_maxrss) * 1024e-9);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Times the bare renderer");
  std::string scene, resolution;
  lightmill::RenderOptions options;
  int threads = static_cast<int>(std::thread::hardware_concurrency());
  int64_t spp = 16;
  app.add_option("scene", scene)->required();
  app.add_option("--integrator", options.integrator);
  app.add_option("--spp", spp);
  app.add_option("--threads", threads)->check(CLI::Range(1, 1024));
  app.add_option("--resolution", resolution, "WxH");
  CLI11_PARSE(app, argc, argv);
  options.spp = spp;
  int width = 0, height = 0;
  if (!resolution.empty()) {
    if (std::sscanf(resolution.c_str(), "%dx%d", &width, &height) != 2) {
      std::fprintf(stderr, "bench_render: --resolution takes WxH\n");
      return 2;
    }
    options.width = width;
    options.height = height;
  }
  try {
    return run(scene, options, threads);
  } catch (const lightmill::Error& e) {
    std::fprintf(stderr, "bench_render: %s\n", e.what());
    return e.exit_code();
  }
}
