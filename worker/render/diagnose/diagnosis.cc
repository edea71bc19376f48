#include "worker/render/diagnose/diagnosis.h"

#include <algorithm>
#include <atomic>
#include <mutex>

#include "common/base/error.h"
#include "common/base/parallel.h"
#include "common/film/film.h"
#include "worker/render/pipeline/context.h"

namespace lightmill {
namespace {

constexpr size_t kBrightest = 24;

float size_of(const StrategyContribution& c) { return std::max({c.rgb[0], c.rgb[1], c.rgb[2]}); }

/// Refuses what would not fit: strategies up to the depth limit, every one with its layer.
void check_memory(const RenderSettings& settings) {
  const int64_t longest = std::min(settings.max_depth + 2, kRecordedVertices);
  const int64_t pixels = int64_t{settings.grid.width} * settings.grid.height;
  const int64_t bytes =
      ((longest + 1) * (longest + 2) / 2 * StrategyFilm::kBytesPerPixel + StrategyFilm::kBytesOfSets) *
      pixels;
  if (bytes > kDiagnosisBytes) {
    throw Error(ErrorKind::kUsage,
                "--diagnose at " + std::to_string(settings.grid.width) + "x" +
                    std::to_string(settings.grid.height) + " would need " + std::to_string(bytes >> 20) +
                    " MiB; lower --resolution or --max-depth, or render a --crop of fewer pixels");
  }
}

/// The images of strategies are made of what is recorded.
BuildOptions with_own_light(int threads) {
  BuildOptions options(threads);
  options.normalised_light = false;
  return options;
}

class Run {
 public:
  Run(const SceneDescription& scene, const RenderSettings& settings, int threads,
      const std::function<bool()>& go_on)
      : settings_(settings),
        renderer_(scene, settings, with_own_light(threads)),
        go_on_(go_on),
        result_(settings.grid, statistics()) {
    const TileSpec tile{settings.grid.cells(), 0, settings.spp};
    PartialBuilder builder = make_builder(tile);
    parallel_for(static_cast<size_t>(threads), threads, [&](size_t) { work(builder); });
    if (stopped_) throw Error(ErrorKind::kFailed, "the diagnosis was interrupted; nothing was written");
    const Partial partial = builder.take();
    Film film(settings.grid);
    film.fold(partial);
    result_.image = film.resolve();
    result_.counters = partial.counters;
    result_.dropped = partial.dropped;
    result_.cpu_seconds = partial.cpu_seconds;
    for (BrightPath& path : result_.brightest) trace(&path);
  }
  Diagnosis take() { return std::move(result_); }

 private:
  SplatStatistics statistics() const {
    return {renderer_.context().filter.splat_noise,
            static_cast<float>(plan_of(renderer_.settings()).light_tracing_weight)};
  }
  PartialBuilder make_builder(const TileSpec& tile) const {
    return PartialBuilder(settings_.grid, tile, renderer_.quantum_exponent(), renderer_.has_camera_layer(),
                          renderer_.has_splat_layer());
  }

  void work(PartialBuilder& builder) {
    const CellRect cells = settings_.grid.cells();
    const int64_t columns = cells.x1 - cells.x0, per_sample = columns * (cells.y1 - cells.y0);
    const auto workspace = renderer_.make_workspace();
    const auto recorder = std::make_unique<StrategyRecorder>();
    recorder->timed = true;
    for (int64_t i; !stopped_ && (i = next_++) < per_sample * settings_.spp;) {
      if (i % per_sample == 0 && !go_on_()) stopped_ = true;
      const int64_t sample = i / per_sample, cell = i % per_sample;
      const Packet packet{cells.x0 + static_cast<int>(cell % columns),
                          cells.y0 + static_cast<int>(cell / columns), sample, sample + 1};
      renderer_.record_packet(packet, *workspace, &builder, *recorder);
      add(packet, *recorder);
      recorder->clear();
    }
    const std::lock_guard lock(mutex_);
    for (size_t s = 0; s < recorder->counts.size(); ++s) {
      for (size_t t = 0; t < recorder->counts.size(); ++t) {
        StrategyCounts& to = result_.counts[s][t];
        const StrategyCounts& from = recorder->counts[s][t];
        to.evaluated += from.evaluated, to.zero += from.zero, to.rouletted += from.rouletted;
        to.occluded += from.occluded, to.visible += from.visible, to.cpu_seconds += from.cpu_seconds;
      }
    }
    result_.light_subpath_seconds += recorder->light_subpath_seconds;
    result_.camera_subpath_seconds += recorder->camera_subpath_seconds;
    result_.inconsistent_hits += recorder->inconsistent_hits;
  }

  /// Which of two contributions comes first in the list: the larger; ties by identity, so that the list does
  /// not depend on the threads.
  static bool before(const BrightPath& a, const BrightPath& b) {
    const auto key = [](const BrightPath& p) {
      return std::make_tuple(-size_of(p.contribution), p.sample, p.cell_y, p.cell_x, p.contribution.slot,
                             p.contribution.s, p.contribution.t, p.contribution.pixel);
    };
    return key(a) < key(b);
  }

  void add(const Packet& packet, const StrategyRecorder& recorder) {
    const std::lock_guard lock(mutex_);
    result_.film.add_sample(recorder.contributions);
    for (const StrategyContribution& c : recorder.contributions) {
      auto& list = result_.brightest;
      const BrightPath path{c, packet.cell_x, packet.cell_y, packet.sample_begin, {}, {}};
      if (list.size() == kBrightest && !before(path, list.back())) continue;
      list.insert(std::upper_bound(list.begin(), list.end(), path, before), path);
      if (list.size() > kBrightest) list.pop_back();
    }
  }

  /// Renders the path's sample again, which gives the same paths, and keeps their vertices.
  void trace(BrightPath* path) {
    const Packet packet{path->cell_x, path->cell_y, path->sample, path->sample + 1};
    const TileSpec tile{{packet.cell_x, packet.cell_y, packet.cell_x + 1, packet.cell_y + 1},
                        packet.sample_begin,
                        packet.sample_end};
    PartialBuilder builder = make_builder(tile);
    const auto workspace = renderer_.make_workspace();
    const auto recorder = std::make_unique<StrategyRecorder>();
    recorder->trace = true;
    renderer_.record_packet(packet, *workspace, &builder, *recorder);
    for (const PathVertex& v : recorder->vertices) {
      const int vertices = v.light ? path->contribution.s : path->contribution.t;
      if (v.slot != path->contribution.slot || v.depth >= vertices) continue;
      BrightPath::Vertex to{renderer_.world_point(v.p), renderer_.material_of(v.primitive), {}};
      std::copy(std::begin(v.throughput), std::end(v.throughput), std::begin(to.throughput));
      (v.light ? path->light : path->camera).push_back(to);
    }
  }

  const RenderSettings& settings_;
  const Renderer renderer_;
  const std::function<bool()>& go_on_;
  Diagnosis result_;
  std::atomic<int64_t> next_{0};
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
};

}  // namespace

Diagnosis diagnose(const SceneDescription& scene, const RenderSettings& settings, int threads,
                   const std::function<bool()>& go_on) {
  check_memory(settings);
  RenderSettings uniform = settings;  // contributions are recorded without the weights of adaptive sampling
  if (uniform.plan) uniform.plan->allocation = {};
  return Run(scene, uniform, threads, go_on).take();
}

}  // namespace lightmill
