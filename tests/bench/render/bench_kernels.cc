// Stages and kernels one by one (Google Benchmark): rays, samples, look-ups and so on per second of CPU time.
//
//   bench_kernels [--scene SCENE] [options of Google Benchmark, e.g. --benchmark_filter=Cast]
#include <benchmark/benchmark.h>
#include <immintrin.h>

#include <cstdio>
#include <filesystem>

#include "common/base/error.h"
#include "common/image/image.h"
#include "tests/bench/render/bench_scene.h"
#include "tests/support/temporary_folder.h"
#include "worker/render/pipeline/bouncer.h"
#include "worker/render/pipeline/caster.h"
#include "worker/render/pipeline/film.h"
#include "worker/render/pipeline/producer.h"
#include "worker/render/pipeline/shadow_caster.h"
#include "worker/render/scene/textures/texture.h"

namespace {

using namespace lightmill;

/// The first layer of the packet in the middle of the image, with its camera paths begun.
class MiddlePacket {
 public:
  explicit MiddlePacket(const bench::Scene& scene)
      : context_(scene.renderer->context()), quantum_(scene.renderer->quantum_exponent()) {
    const CellRect cells = scene.settings.grid.cells();
    layer_.slots = &w_->slots;
    layer_.light_paths = kWavefront;
    w_->slots.begin_superblock(context_, (cells.x0 + cells.x1) / 2, (cells.y0 + cells.y1) / 2, 0,
                               PixelSubset());
    w_->slots.begin_even_pass(0);
    w_->camera_sums.assign(kCellPixels, {});
    produce();
  }
  void produce() { produce_camera_paths(context_, layer_, *w_); }
  void produce_light() { produce_light_paths(context_, layer_, *w_), w_->shadow.count = 0; }
  void cast() { cast_paths(context_, *w_); }
  void bounce() { bounce_camera_paths(context_, layer_, 1, *w_); }
  void next_event() { shadow_next_event(context_, layer_, 1, *w_); }
  void flush() { flush_shadow_rays(context_, false, *w_); }
  void occluded() {
    ShadowRays& q = w_->shadow;
    context_.accel.occluded({q.ox, q.oy, q.oz, q.dx, q.dy, q.dz}, q.tfar, q.count, q.occluded);
  }
  void finish() { film_finish_pass(context_, quantum_, *w_); }
  Wavefront& wavefront() { return *w_; }

 private:
  const StageContext& context_;
  int quantum_;
  std::unique_ptr<Wavefront> w_ = std::make_unique<Wavefront>();
  LayerContext layer_;
};

void add_stages(const bench::Scene& scene) {
  // Denormals are flushed, as in the renderer.
  _mm_setcsr(_mm_getcsr() | 0x8040);
  const auto add = [&](const char* name, auto&& prepare, auto&& count, auto&& run) {
    benchmark::RegisterBenchmark(name, [&scene, prepare, count, run](benchmark::State& state) {
      MiddlePacket packet(scene);
      prepare(packet);
      const int64_t items = count(packet.wavefront());
      for (auto _ : state) run(packet);
      state.SetItemsProcessed(state.iterations() * items);
    });
  };
  const auto nothing = [](MiddlePacket&) {};
  const auto paths = [](Wavefront& w) { return int64_t{w.paths.active_count}; };
  const auto vertices = [](Wavefront& w) { return static_cast<int64_t>(w.vertices.size()); };
  const auto to_vertices = [](MiddlePacket& p) { p.cast(), p.bounce(); };
  add("ProduceCamera", nothing, paths, [](MiddlePacket& p) { p.produce(); });
  add(
      "ProduceLight", nothing, [](Wavefront&) { return int64_t{kWavefront}; },
      [](MiddlePacket& p) { p.produce_light(); });
  add("CastCamera", nothing, paths, [](MiddlePacket& p) { p.cast(); });
  add("ProduceCastBounce", nothing, paths, [](MiddlePacket& p) { p.produce(), p.cast(), p.bounce(); });
  add("CastBounced", to_vertices, paths, [](MiddlePacket& p) { p.cast(); });
  add("NextEventFormed", to_vertices, vertices,
      [](MiddlePacket& p) { p.next_event(), p.wavefront().shadow.count = 0; });
  add(
      "Occluded", [=](MiddlePacket& p) { to_vertices(p), p.next_event(); },
      [](Wavefront& w) { return int64_t{w.shadow.count}; }, [](MiddlePacket& p) { p.occluded(); });
  add(
      "FilmFinish", nothing, [](Wavefront&) { return int64_t{kWavefront}; },
      [](MiddlePacket& p) { p.finish(); });
}

void sobol(benchmark::State& state) {
  SampleStream<Lane> stream{splat_uint<Lane>(12345), as_uint(lane_index<Lane>())};
  Lane sum{};
  for (auto _ : state) {
    Lane u, v;
    for (uint32_t d = 0; d < 32; ++d) {
      stream.get_2d(d, &u, &v);
      sum = sum + u * v;
    }
  }
  benchmark::DoNotOptimize(sum);
  state.SetItemsProcessed(state.iterations() * 32 * kLanes);
}

/// Look-ups in an image of 1024 x 1024 at places that follow one another closely, or anywhere
/// (`state.range`).
void texture(benchmark::State& state, bool in_cache) {
  const test::TemporaryFolder folder;
  constexpr int kSide = 1024;
  Image image(kSide, kSide);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i % 251) / 251;
  TextureDescription d;
  ImageTexture t;
  t.path = folder.file("image.png");
  write_image(image, t.path);
  d.kind = t;
  const TextureTable table({d}, {1, in_cache ? 0 : kUnboundedTextures});
  const uint32_t step = state.range(0) ? 2654435761u : 1u << 19;
  uint32_t at = 1;
  float sum = 0;
  for (auto _ : state) {
    at += step;
    const auto u = static_cast<float>(at >> 8) * 0x1p-24f;
    sum += table.evaluate(0, {u, 0.37f + 0.01f * u}).r;
  }
  benchmark::DoNotOptimize(sum);
  state.SetItemsProcessed(state.iterations());
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  CLI::App app("Times stages and kernels", "bench_kernels");
  bench::Options options;
  options.scene = LIGHTMILL_SOURCE_DIR "/scenes/cornell-spheres.pbrt";
  options.render.integrator = "bdpt";
  options.resolution = "256x256";
  app.add_option("--scene", options.scene);
  return bench::run_main(app, argc, argv, [&] {
    const bench::Scene scene = bench::build(options);
    add_stages(scene);
    benchmark::RegisterBenchmark("Sobol2d", sobol);
    benchmark::RegisterBenchmark("TextureInMemory", texture, false)->Arg(0)->Arg(1);
    benchmark::RegisterBenchmark("TextureInCache", texture, true)->Arg(0)->Arg(1);
    benchmark::RunSpecifiedBenchmarks();
  });
}
