// The same stages in two designs: private wavefronts, a thread taking one through all stages, against global
// queues between the stages, from which any thread takes the next wavefront. One line of JSON.
//
//   bench_queues SCENE --integrator bdpt --spp 4 [--threads N] [--runs N] [--one-in N] [--in-flight N]
//
// Items are wavefronts of up to 1024 paths, as the stages are written for them; --one-in N leaves one of N
// pixels a path, so that items are smaller in both designs. --in-flight: wavefronts per thread in the queues.
// Both designs run in turn, --runs times each, and must give the same bits. Figures: wall and CPU seconds,
// and how often a thread was put to sleep and woken (voluntary context switches).
#include <immintrin.h>
#include <sys/resource.h>

#include <array>
#include <atomic>
#include <coroutine>
#include <cstdio>
#include <deque>
#include <mutex>
#include <nlohmann/json.hpp>
#include <semaphore>
#include <span>
#include <thread>

#include "common/base/error.h"
#include "common/base/parallel.h"
#include "common/job/light_path_count.h"
#include "tests/bench/render/bench_scene.h"
#include "worker/render/pipeline/bouncer.h"
#include "worker/render/pipeline/caster.h"
#include "worker/render/pipeline/film.h"
#include "worker/render/pipeline/light_path_sampling.h"
#include "worker/render/pipeline/producer.h"
#include "worker/render/pipeline/shadow_caster.h"

namespace {

using namespace lightmill;

/// Queues, first in first out, one for each stage; the later stages go first, so that what was begun ends.
class StageQueues {
 public:
  enum Name { kProducer, kCaster, kBouncer, kShadowCaster, kFilm, kCount };

  void push(Name name, std::coroutine_handle<> item) {
    {
      const std::lock_guard lock(queues_[name].mutex);
      queues_[name].items.push_back(item);
    }
    waiting_.release();
  }
  /// The next item, or none once there is nothing more to come.
  std::coroutine_handle<> pop() {
    waiting_.acquire();
    for (size_t name = kCount; name-- > 0;) {
      const std::lock_guard lock(queues_[name].mutex);
      if (queues_[name].items.empty()) continue;
      const auto item = queues_[name].items.front();
      queues_[name].items.pop_front();
      return item;
    }
    return {};
  }
  void end(int threads) { waiting_.release(threads); }

 private:
  struct Queue {
    std::mutex mutex;
    std::deque<std::coroutine_handle<>> items;
  };
  std::array<Queue, kCount> queues_;
  std::counting_semaphore<> waiting_{0};
};

/// To go on in a stage is to wait in its queue.
struct InStage {
  StageQueues& queues;
  StageQueues::Name name;
  bool await_ready() const { return false; }
  void await_suspend(std::coroutine_handle<> self) const { queues.push(name, self); }
  void await_resume() const {}
};

struct Task {
  struct promise_type {
    Task get_return_object() { return {std::coroutine_handle<promise_type>::from_promise(*this)}; }
    std::suspend_always initial_suspend() { return {}; }
    std::suspend_never final_suspend() noexcept { return {}; }
    void return_void() {}
    void unhandled_exception() { std::terminate(); }
  };
  std::coroutine_handle<> handle;
};

struct Work {
  const StageContext& context;
  int quantum_exponent;
  const std::vector<Packet>& packets;
  PartialBuilder& builder;
  StageQueues queues;
  std::atomic<size_t> next{0};
  std::atomic<int> wavefronts{0};  // that have not ended
  int threads = 1;
};

/// render_packet of pipeline.cc without recorders, cut where stages change.
Task render_packets(Work& work) {
  using Q = StageQueues;
  const StageContext& context = work.context;
  auto wavefront = std::make_unique<Wavefront>();
  Wavefront& w = *wavefront;
  const auto in = [&](Q::Name name) { return InStage{work.queues, name}; };
  for (size_t i; (i = work.next++) < work.packets.size();) {
    const Packet& packet = work.packets[i];
    co_await in(Q::kProducer);
    w.counters = {};
    w.dropped = w.dropped_light = {};
    w.splats.clear();
    const int64_t superblock = superblock_of_sample(packet.sample_begin);
    LayerContext layer{0, &w.slots};
    w.slots.begin_superblock(context, packet.cell_x, packet.cell_y, superblock, context.pixel_subset);
    layer.light_paths = light_paths_of_layer(context.light_paths, w.slots.inside_count);
    set_light_path_sampling(context, packet.cell_x, packet.cell_y, superblock, &layer);
    w.camera_sums.assign(kCellPixels, {});
    for (int64_t s = packet.sample_begin; s < packet.sample_end; ++s) {
      layer.sample_in_superblock = static_cast<uint32_t>(s - superblock * kSuperblockSamples);
      w.light_vertices.clear();
      for (layer.first_light_path = 0; context.on(kLightPaths) && layer.first_light_path < layer.light_paths;
           layer.first_light_path += kWavefront) {
        produce_light_paths(context, layer, w);
        for (int depth = 1; w.paths.active_count > 0 && depth <= context.max_depth; ++depth) {
          if (!context.on(kVertexConnections)) w.light_vertices.clear();
          const size_t first = w.light_vertices.size();
          co_await in(Q::kCaster);
          cast_paths(context, w);
          co_await in(Q::kBouncer);
          bounce_light_paths(context, layer, depth, w);
          if (!context.on(kLightTracing)) continue;
          co_await in(Q::kShadowCaster);
          shadow_light_tracing(context, layer, depth, first, w);
        }
        flush_shadow_rays(context, true, w);
        co_await in(Q::kProducer);
      }
      w.slots.begin_even_pass(s);
      for (float* radiance : {w.radiance_r, w.radiance_g, w.radiance_b})
        std::fill_n(radiance, kWavefront, 0.0f);
      produce_camera_paths(context, layer, w);
      for (int depth = 1; w.paths.active_count > 0; ++depth) {
        co_await in(Q::kCaster);
        cast_paths(context, w);
        co_await in(Q::kBouncer);
        bounce_camera_paths(context, layer, depth, w);
        co_await in(Q::kShadowCaster);
        if (context.on(kNextEvent)) shadow_next_event(context, layer, depth, w);
        if (context.on(kVertexConnections)) shadow_connections(context, layer, depth, w);
        flush_shadow_rays(context, false, w);
      }
      co_await in(Q::kFilm);
      film_finish_pass(context, work.quantum_exponent, w);
    }
    if (!w.splats.empty()) work.builder.add_splats(w.splats);
    work.builder.add_camera(packet.cell_x, packet.cell_y,
                            std::span<const ExactRgb, kCellPixels>(w.camera_sums));
    work.builder.add_dropped(w.dropped, w.dropped_light);
    work.builder.add_counters(w.counters, 0);
  }
  if (--work.wavefronts == 0) work.queues.end(work.threads);
}

void render_by_queues(const bench::Scene& scene, const std::vector<Packet>& packets, int threads,
                      int in_flight, PartialBuilder& builder) {
  Work work{
      scene.renderer->context(), scene.renderer->quantum_exponent(), packets, builder, {}, {}, {}, threads};
  work.wavefronts = threads * in_flight;
  for (int i = 0; i < threads * in_flight; ++i)
    work.queues.push(StageQueues::kProducer, render_packets(work).handle);
  std::vector<std::jthread> pool;
  for (int t = 0; t < threads; ++t) {
    pool.emplace_back([&] {
      _mm_setcsr(_mm_getcsr() | 0x8040);  // denormals are flushed, as in the renderer
      while (const auto item = work.queues.pop()) item.resume();
    });
  }
}

void render_privately(const bench::Scene& scene, const std::vector<Packet>& packets, int threads,
                      PartialBuilder& builder) {
  std::atomic<size_t> next{0};
  std::vector<std::jthread> pool;
  for (int t = 0; t < threads; ++t) {
    pool.emplace_back([&] {
      const auto workspace = scene.renderer->make_workspace();
      for (size_t i; (i = next++) < packets.size();)
        scene.renderer->render_packet(packets[i], *workspace, builder);
    });
  }
}

struct Usage {
  double cpu = 0;
  int64_t switches = 0;
};
Usage usage() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {seconds(u.ru_utime) + seconds(u.ru_stime), u.ru_nvcsw};
}

void run(const bench::Options& options, int runs, uint32_t one_in, int in_flight) {
  bench::Scene scene = bench::build(options);
  if (!plan_of(scene.settings).allocation.uniform() || !scene.renderer->has_camera_layer())
    throw Error(ErrorKind::kUsage, "the queues know no lt and no plan that samples adaptively");
  scene.renderer = std::make_unique<Renderer>(*scene.renderer, scene.settings, PixelSubset{one_in});
  const std::vector<Packet> packets = scene.packets();
  const int threads = thread_count(options.threads);
  nlohmann::ordered_json out;
  std::string digest;
  const auto measure = [&](const char* name, const auto& render) {
    PartialBuilder builder = scene.builder();
    const Usage before = usage();
    const double wall = bench::seconds_of([&] { render(builder); });
    const Usage after = usage();
    Partial partial = builder.take();
    partial.cpu_seconds = 0;
    if (const std::string now = partial_digest(partial); digest.empty()) {
      digest = now;
    } else if (now != digest) {
      throw Error(ErrorKind::kFailed, "the two designs differ in their bits");
    }
    out[name]["wall_s"].push_back(wall);
    out[name]["cpu_s"].push_back(after.cpu - before.cpu);
    out[name]["switches"].push_back(after.switches - before.switches);
  };
  for (int i = 0; i < runs; ++i) {
    measure("private", [&](PartialBuilder& builder) { render_privately(scene, packets, threads, builder); });
    measure("queues",
            [&](PartialBuilder& builder) { render_by_queues(scene, packets, threads, in_flight, builder); });
  }
  std::printf("%s\n", out.dump().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Private wavefronts against global queues between the stages", "bench_queues");
  lightmill::bench::Options options;
  options.spp = 4;
  int runs = 1, in_flight = 4;
  uint32_t one_in = 1;
  add_options(app, &options);
  app.add_option("--runs", runs)->check(CLI::Range(1, 1000));
  app.add_option("--one-in", one_in, "A power of two")->check(CLI::IsMember({1, 4, 16, 64, 256}));
  app.add_option("--in-flight", in_flight)->check(CLI::Range(1, 64));
  return lightmill::bench::run_main(app, argc, argv, [&] { run(options, runs, one_in, in_flight); });
}
