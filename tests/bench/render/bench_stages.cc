// One thread of the renderer looked at from inside, as one line of JSON.
//
//   bench_stages SCENE --integrator bdpt --spp 4 [--resolution WxH] [--runs N] [--limit]
//
// us_per_sample: CPU time of a pixel sample without a probe, for every run; stages: what part of the time
// each stage takes (of a run with a probe); in_traversal: that of casting and occlusion. With --limit the
// rays of the render are traced once more by bare Embree, in turn with the render: limit_ratio is Embree's
// time over the render's, for every run.
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numeric>

#include "tests/bench/render/bare_embree.h"
#include "tests/bench/render/bench_scene.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/recording/stage_probe.h"
#include "worker/render/pipeline/recording/thread_time.h"

namespace {

using namespace lightmill;

/// Rays of each kind to replay: they take about 80 bytes each.
constexpr size_t kMostRays = 1 << 20;

struct Bench {
  const bench::Scene& scene;
  std::unique_ptr<Workspace> workspace = scene.renderer->make_workspace();

  /// CPU seconds of these packets.
  double render(const std::vector<Packet>& packets, StageProbe* probe) {
    PartialBuilder builder = scene.builder();
    Renderer::set_probe(*workspace, probe);
    if (probe) probe->start();
    const double start = thread_cpu_seconds();
    for (const Packet& packet : packets) scene.renderer->render_packet(packet, *workspace, builder);
    if (probe) probe->enter(Stage::kOther);
    return thread_cpu_seconds() - start;
  }
  /// Packets from all over the image, as many as it takes to cast kMostRays rays of a kind. Their
  /// rays go to `probe`.
  std::vector<Packet> sample_packets(const std::vector<Packet>& all, StageProbe* probe) {
    std::vector<Packet> some;
    const size_t step = std::max<size_t>(1, all.size() / 7);
    probe->keep_rays = true;
    for (size_t first = 0; first < step; ++first) {
      for (size_t i = first; i < all.size(); i += step) {
        if (std::max(probe->closest.size(), probe->occlusion.size()) > kMostRays) return some;
        render({all[i]}, probe);
        some.push_back(all[i]);
      }
    }
    return some;
  }
};

void run(const bench::Options& options, int runs, bool limit) {
  const bench::Scene scene = bench::build(options);
  const std::vector<Packet> packets = scene.packets();
  Bench bench{scene};
  nlohmann::ordered_json out;
  bench.render({packets.front()}, nullptr);  // caches warm, pages there
  std::vector<double> us;
  for (int i = 0; i < runs; ++i) us.push_back(bench.render(packets, nullptr) / scene.samples() * 1e6);
  StageProbe probe;
  bench.render(packets, &probe);
  const double all = std::accumulate(probe.seconds().begin(), probe.seconds().end(), 0.0);
  out["us_per_sample"] = us;
  for (size_t i = 0; i < kStages; ++i) out["stages"][kStageNames[i]] = probe.seconds()[i] / all;
  const auto share = [&](Stage s) { return probe.seconds()[static_cast<size_t>(s)] / all; };
  out["in_traversal"] = share(Stage::kCast) + share(Stage::kOcclude);
  if (limit) {
    bench::BareEmbree embree(scene.renderer->context().scene);
    StageProbe recorder;
    const std::vector<Packet> some = bench.sample_packets(packets, &recorder);
    embree.take(recorder.closest, recorder.occlusion);
    std::vector<double> ratios, closest, occlusion;
    for (int i = 0; i < runs; ++i) {
      const double ours = bench.render(some, nullptr);
      const double near = embree.closest_seconds(), free = embree.occlusion_seconds();
      ratios.push_back((near + free) / ours);
      closest.push_back(static_cast<double>(recorder.closest.size()) / near * 1e-6);
      occlusion.push_back(static_cast<double>(recorder.occlusion.size()) / free * 1e-6);
    }
    out["limit_ratio"] = ratios;
    out["embree_closest_mrays"] = closest;
    out["embree_occlusion_mrays"] = occlusion;
    out["rays_replayed"] = recorder.closest.size() + recorder.occlusion.size();
  }
  std::printf("%s\n", out.dump().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Times the stages of one render thread, and the same rays in bare Embree", "bench_stages");
  lightmill::bench::Options options;
  options.spp = 4;
  int runs = 1;
  bool limit = false;
  add_options(app, &options);
  app.add_option("--runs", runs)->check(CLI::Range(1, 1000));
  app.add_flag("--limit", limit);
  return lightmill::bench::run_main(app, argc, argv, [&] { run(options, runs, limit); });
}
