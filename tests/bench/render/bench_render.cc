// Renders a scene with the bare renderer (no farm, no commits, no fold) and prints one line of JSON.
//
//   bench_render SCENE --integrator bdpt --spp 16 [--resolution WxH] [--threads N]
//
// load_s: reading the scene; build_s: textures, normalisation, acceleration structure; pilot_s: choosing the
// sampling plan (auto, the default, only); render_s: wall time of the packets; cpu_s: of the render threads;
// scene_mb: what the renderer says of its memory; peak_mb: resident set of the process.
#include <atomic>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/base/parallel.h"
#include "tests/bench/render/bench_scene.h"

namespace {

/// The most that this program had resident. Not by getrusage: its figure starts at the parent's.
double peak_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) * 1024e-6;
  }
  throw std::runtime_error("/proc/self/status has no VmHWM");
}

void run(const lightmill::bench::Options& options) {
  const lightmill::bench::Scene scene = lightmill::bench::build(options);
  const std::vector<lightmill::Packet> packets = scene.packets();
  lightmill::PartialBuilder builder = scene.builder();
  std::atomic<size_t> next{0};
  const double render_s = lightmill::bench::seconds_of([&] {
    std::vector<std::jthread> pool;
    for (int t = 0; t < lightmill::thread_count(options.threads); ++t) {
      pool.emplace_back([&] {
        const auto workspace = scene.renderer->make_workspace();
        for (size_t i; (i = next++) < packets.size();)
          scene.renderer->render_packet(packets[i], *workspace, builder);
      });
    }
  });
  const lightmill::Partial partial = builder.take();
  const auto& c = partial.counters;
  const double samples = scene.samples();
  const auto per_sample = [&](uint64_t n) { return static_cast<double>(n) / samples; };
  const nlohmann::ordered_json figures = {
      {"load_s", scene.load_s},
      {"build_s", scene.build_s},
      {"pilot_s", scene.pilot_s},
      {"render_s", render_s},
      {"cpu_s", partial.cpu_seconds},
      {"msamples_per_s", samples / render_s * 1e-6},
      {"us_per_sample", partial.cpu_seconds / samples * 1e6},
      {"mrays_per_cpu_s",
       static_cast<double>(c.closest_hit_rays + c.shadow_rays) / partial.cpu_seconds * 1e-6},
      {"closest_rays_per_sample", per_sample(c.closest_hit_rays)},
      {"shadow_rays_per_sample", per_sample(c.shadow_rays)},
      {"zero_skipped_per_sample", per_sample(c.zero_connections_skipped)},
      {"rouletted_per_sample", per_sample(c.rouletted_connections)},
      {"nonfinite", c.nonfinite},
      {"scene_mb", static_cast<double>(scene.renderer->memory_bytes()) * 1e-6},
      {"peak_mb", peak_mb()}};
  std::printf("%s\n", figures.dump().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Times the bare renderer", "bench_render");
  lightmill::bench::Options options;
  add_options(app, &options);
  return lightmill::bench::run_main(app, argc, argv, [&] { run(options); });
}
