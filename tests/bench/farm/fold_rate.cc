// How fast partials become part of a film: real ones, rendered here, are decoded, checked and folded as the
// coordinator does it, over and over in memory.
//
//   fold_rate SCENE [--integrator pt] [--resolution 512x512] [--samples 16] [--threads 2] [--seconds 1]
//
// Bytes are those of the sums: 48 for each pixel of a camera layer and each splat pixel (three 128-bit
// integers). Prints one line of JSON: partial_bytes, sum_bytes (of one partial), and in GB/s of sums
// film_gbps (Film::fold alone), merge_gbps (decoding with its digests and checks, folding into film and
// batches), both of one thread by its processor time, and by wall time merge_threads_gbps, of so many threads
// with a job each, and merge_job_gbps, of as many that hand in to one job: they decode side by side and fold
// one after the other.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <mutex>
#include <numeric>
#include <thread>
#include <vector>

#include "common/base/error.h"
#include "common/error/batch_film.h"
#include "common/film/film.h"
#include "common/film/partial_decoder.h"
#include "common/scene/load.h"
#include "common/scene/resolve_settings.h"
#include "worker/render/renderer.h"

namespace {

using namespace lightmill;

constexpr double kSumBytes = 48;

double cpu_seconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Partial render(const Renderer& renderer, int64_t samples) {
  const auto workspace = renderer.make_workspace();
  const CellRect cells = renderer.settings().grid.cells();
  PartialBuilder builder(renderer.settings().grid, {cells, 0, samples}, renderer.quantum_exponent(),
                         renderer.has_camera_layer(), renderer.has_splat_layer());
  for (int64_t b = 0; block_begin(b) < samples; ++b) {
    for (int y = cells.y0; y < cells.y1; ++y) {
      for (int x = cells.x0; x < cells.x1; ++x) {
        renderer.render_packet({x, y, block_begin(b), std::min(block_end(b), samples)}, *workspace, builder);
      }
    }
  }
  return builder.take();
}

/// How often `action` is done in a second of what `clock` counts, measured over `seconds` of it.
template <class Action>
double rate(double (*clock)(), double seconds, Action&& action) {
  action();  // film and batches are there from now on
  const double start = clock();
  double now = start;
  int64_t times = 0;
  for (; now - start < seconds; now = clock(), ++times) action();
  return static_cast<double>(times) / (now - start);
}

struct Job {
  explicit Job(const FilmGrid& grid) : film(grid), batches(grid) {}
  void merge(const std::string& bytes, const TileSpec& tile) {
    thread_local PartialDecoder decoder;  // as the coordinator has one for each thread that commits
    const Partial& partial = decoder.decode(bytes, film.grid(), tile);
    const std::lock_guard lock(mutex);
    film.fold(partial);
    batches.fold(partial);
  }
  std::mutex mutex;
  Film film;
  BatchFilm batches;
};

/// `merge` by so many threads at once, together a second of wall time.
template <class Merge>
double rate_of_threads(int threads, double seconds, Merge&& merge) {
  std::vector<double> rates(static_cast<size_t>(threads));
  std::vector<std::thread> running;
  for (size_t i = 0; i < rates.size(); ++i) {
    running.emplace_back([&, i] { rates[i] = rate(wall_seconds, seconds, [&] { merge(i); }); });
  }
  for (std::thread& thread : running) thread.join();
  return std::accumulate(rates.begin(), rates.end(), 0.0);
}

int run(const std::string& path, const RenderOptions& options, int64_t samples, int threads, double seconds) {
  const SceneDescription scene = load_scene_file(path, {}, [](const Problem&) {});
  const RenderSettings settings = resolve_settings(scene, options);
  const Partial partial = render(Renderer(scene, settings, 1), samples);
  const std::string bytes = encode_partial(partial);
  const double sums = kSumBytes * static_cast<double>(partial.camera.size() + partial.splats.size());
  Film film(settings.grid);
  const double folds = rate(cpu_seconds, seconds, [&] { film.fold(partial); });
  Job job(settings.grid);
  const double merges = rate(cpu_seconds, seconds, [&] { job.merge(bytes, partial.tile); });
  std::vector<std::unique_ptr<Job>> jobs;
  for (int i = 0; i < threads; ++i) jobs.push_back(std::make_unique<Job>(settings.grid));
  const double apart =
      rate_of_threads(threads, seconds, [&](size_t i) { jobs[i]->merge(bytes, partial.tile); });
  const double together = rate_of_threads(threads, seconds, [&](size_t) { job.merge(bytes, partial.tile); });
  std::printf(
      "{\"partial_bytes\": %zu, \"sum_bytes\": %.0f, \"film_gbps\": %.3f, \"merge_gbps\": %.3f, "
      "\"merge_threads_gbps\": %.3f, \"merge_job_gbps\": %.3f, \"threads\": %d}\n",
      bytes.size(), sums, 1e-9 * sums * folds, 1e-9 * sums * merges, 1e-9 * sums * apart,
      1e-9 * sums * together, threads);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Rate of merging partials");
  std::string scene, resolution = "512x512";
  RenderOptions options;
  options.integrator = "pt";
  int64_t samples = 16;
  int threads = 2;
  double seconds = 1;
  app.add_option("scene", scene)->required();
  app.add_option("--integrator", options.integrator)->check(CLI::IsMember({"pt", "bdpt", "lt"}));
  app.add_option("--resolution", resolution, "WxH");
  app.add_option("--samples", samples, "of the partial, which has the whole image")
      ->check(CLI::Range(1, 1024));
  app.add_option("--threads", threads)->check(CLI::Range(1, 256));
  app.add_option("--seconds", seconds, "of each measurement")->check(CLI::Range(0.001, 600.0));
  CLI11_PARSE(app, argc, argv);
  int width = 0, height = 0;
  if (std::sscanf(resolution.c_str(), "%dx%d", &width, &height) != 2) {
    std::fprintf(stderr, "fold_rate: --resolution takes WxH\n");
    return 2;
  }
  options.spp = samples;
  options.width = width;
  options.height = height;
  try {
    return run(scene, options, samples, threads, seconds);
  } catch (const Error& e) {
    std::fprintf(stderr, "fold_rate: %s\n", e.what());
    return e.exit_code();
  }
}
