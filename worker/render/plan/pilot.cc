#include "worker/render/plan/pilot.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

#include "common/error.h"
#include "worker/render/pipeline/strategy_recorder.h"
#include "worker/render/plan/cost_model.h"
#include "worker/render/plan/plan_moments.h"
#include "worker/render/sampling/sobol.h"

namespace lightmill {
namespace {

/// Camera paths that a pilot traces at most, and samples per pixel of the cells that it takes.
constexpr int64_t kPilotPaths = int64_t{1} << 18;
constexpr int64_t kLeastSamples = 2, kMostSamples = 32;
/// The pilot's samples are not those of the image, which they would bias.
constexpr uint64_t kPilotSeed = 0x70696c6f74;
/// Blocks of samples of one pixel are stratified in the camera layer, which lowers its variance by about this
/// factor against independent ones; splats gain next to nothing (measured by tests/bench/error_time).
constexpr double kStratification = 1.4;
/// Smallest gain for which a plan with more strategies is preferred.
constexpr double kWorthIt = 0.98;

/// Plans without which nothing is lost in this scene.
std::vector<SamplingPlan> candidates(const ScenePlan& scene) {
  std::vector<SamplingPlan> plans;
  const auto add = [&](Strategies set, double light_paths, double connections) {
    if ((set & scene.required) == scene.required) plans.push_back({set, light_paths, connections});
  };
  const Strategies base = scene.useful & (kEmissionHits | kNextEvent);
  add(base, 1, 1);
  if (base & kEmissionHits && base != kEmissionHits) add(kEmissionHits, 1, 1);
  for (const double light_paths : kLightPathCounts) {
    add(base | kLensConnections, light_paths, 1);
    for (const double connections : kConnectionCounts) {
      add(base | kVertexConnections, light_paths, connections);
      add(base | kLensConnections | kVertexConnections, light_paths, connections);
    }
  }
  return plans;
}

/// The cells that the pilot renders: at most `count`, spread evenly but without a pattern.
std::vector<int64_t> pilot_cells(int64_t cells, int64_t count) {
  std::vector<int64_t> chosen;
  for (int64_t i = 0; i < count; ++i) {
    const int64_t begin = i * cells / count, end = (i + 1) * cells / count;
    const uint32_t h = hash32(static_cast<uint32_t>(i) ^ static_cast<uint32_t>(kPilotSeed));
    chosen.push_back(begin + static_cast<int64_t>(h % static_cast<uint32_t>(end - begin)));
  }
  return chosen;
}

class Pilot {
 public:
  Pilot(const Renderer& scene, const std::function<bool()>& go_on)
      : settings_(pilot_settings(scene.settings())),
        renderer_(scene, settings_),
        plans_(candidates(renderer_.plan())),
        go_on_(go_on),
        grid_(settings_.grid.cells()) {
    const int64_t count = grid_.count();
    samples_ = kLeastSamples;
    while (samples_ < kMostSamples && 2 * samples_ * count * kCellPixels <= kPilotPaths) samples_ *= 2;
    cells_ = pilot_cells(count, std::min(count, kPilotPaths / (samples_ * kCellPixels)));
    results_.resize(cells_.size());
  }

  PilotReport run(int threads) {
    std::vector<std::thread> pool;
    for (int t = 0; t < threads; ++t) pool.emplace_back([this] { work(); });
    for (std::thread& t : pool) t.join();
    if (failure_) std::rethrow_exception(failure_);
    if (stopped_) throw Error(ErrorKind::kFailed, "the pilot was interrupted");
    return choose();
  }

 private:
  static RenderSettings pilot_settings(RenderSettings settings) {
    settings.plan = SamplingPlan{};
    settings.seed ^= kPilotSeed;
    return settings;
  }

  CellRect rect_of(int64_t cell) const {
    const int64_t columns = grid_.x1 - grid_.x0;
    const int x = grid_.x0 + static_cast<int>(cell % columns),
              y = grid_.y0 + static_cast<int>(cell / columns);
    return {x, y, x + 1, y + 1};
  }

  void work() {
    try {
      const auto workspace = renderer_.make_workspace();
      const auto recorder = std::make_unique<StrategyRecorder>();
      MomentRecorder moments(plans_);
      RenderCounters counters;
      for (size_t i; !stopped_ && (i = next_++) < cells_.size();) {
        if (!go_on_()) stopped_ = true;
        const CellRect rect = rect_of(cells_[i]);
        const TileSpec tile{rect, 0, samples_};
        PartialBuilder builder(settings_.grid, tile, renderer_.quantum_exponent(), true, true);
        moments.begin_cell();
        for (int64_t s = 0; s < samples_; ++s) {
          renderer_.record_packet({rect.x0, rect.y0, s, s + 1}, *workspace, builder, *recorder);
          moments.add_sample(recorder->contributions);
          recorder->clear();
        }
        std::array<bool, kCellPixels> inside{};
        const PixelRect pixels = settings_.grid.pixels(rect);
        for (int slot = 0; slot < kCellPixels; ++slot) {
          const int x = rect.x0 * kCellSize + slot % kCellSize, y = rect.y0 * kCellSize + slot / kCellSize;
          inside[static_cast<size_t>(slot)] =
              x >= pixels.x0 && x < pixels.x1 && y >= pixels.y0 && y < pixels.y1;
        }
        results_[i] = moments.end_cell(inside);
        counters += builder.take().counters;
      }
      const std::lock_guard lock(mutex_);
      counters_ += counters;
      count_work(*recorder);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      stopped_ = true;
    }
  }

  void count_work(const StrategyRecorder& recorder) {
    for (size_t s = 0; s < recorder.counts.size(); ++s) {
      for (size_t t = 0; t < recorder.counts.size(); ++t) {
        const StrategyCounts& c = recorder.counts[s][t];
        const auto rays = static_cast<double>(c.occluded + c.visible);
        if (t == 1) {
          work_.lens_rays += rays;
        } else if (s > 0) {
          (s == 1 ? work_.next_event_rays : work_.connection_rays) += rays;
        }
      }
    }
    work_.camera_hits += static_cast<double>(recorder.camera_hits);
    work_.light_hits += static_cast<double>(recorder.light_hits);
  }

  /// Splats land anywhere: each goes to its block, if the pilot took that cell. One light path stands for
  /// all that the film has per unit of spp.
  void add_splats() {
    std::vector<int32_t> result_of(static_cast<size_t>(grid_.count()), -1);
    for (size_t i = 0; i < cells_.size(); ++i)
      result_of[static_cast<size_t>(cells_[i])] = static_cast<int32_t>(i);
    const float scale = counters_.light_paths == 0
                            ? 0
                            : static_cast<float>(static_cast<double>(settings_.grid.light_paths_per_spp()) /
                                                 static_cast<double>(counters_.light_paths));
    const auto width = static_cast<uint32_t>(settings_.grid.width);
    for (CellMoments& from : results_) {
      for (const RecordedSplat& splat : from.splats) {
        const int x = static_cast<int>(splat.pixel % width), y = static_cast<int>(splat.pixel / width);
        const int64_t cell =
            int64_t{y / kCellSize - grid_.y0} * (grid_.x1 - grid_.x0) + x / kCellSize - grid_.x0;
        const int32_t to = result_of[static_cast<size_t>(cell)];
        if (to < 0) continue;
        const int block =
            y % kCellSize / kMomentBlock * (kCellSize / kMomentBlock) + x % kCellSize / kMomentBlock;
        add_splat(plans_, splat, scale, &results_[static_cast<size_t>(to)].blocks[static_cast<size_t>(block)],
                  &from.lost);
      }
    }
  }

  /// Mean over pixels and channels of variance / (value^2 + 0.01), per plan.
  std::array<double, kMaxPlans> relative_variances() const {
    std::array<double, kMaxPlans> sum{};
    double pixels = 0;
    for (const CellMoments& cell : results_) {
      for (const BlockMoments& block : cell.blocks) {
        if (block.pixels == 0) continue;
        pixels += block.pixels;
        for (size_t ch = 0; ch < 3; ++ch) {
          const double mean = double{block.mean[ch]} / block.pixels;
          for (size_t k = 0; k < kMaxPlans; ++k) {
            const double camera = std::max(0.0, double{block.camera[ch][k]}) / kStratification;
            sum[k] += (camera + double{block.splat[ch][k]}) / (mean * mean + 0.01);
          }
        }
      }
    }
    for (double& s : sum) s /= 3 * std::max(pixels, 1.0);
    return sum;
  }

  PilotReport choose() {
    add_splats();
    const auto variances = relative_variances();
    const double samples = std::max(1.0, static_cast<double>(counters_.camera_paths));
    SampleWork work = work_;
    for (double* w :
         {&work.camera_hits, &work.light_hits, &work.next_event_rays, &work.connection_rays, &work.lens_rays})
      *w /= samples;
    work.primitives = static_cast<double>(renderer_.plan().primitives);
    PilotReport report;
    report.work = work;
    report.samples = static_cast<int64_t>(counters_.camera_paths);
    double best = -1;
    for (size_t k = 0; k < plans_.plans.size(); ++k) {
      double lost = 0;
      for (const CellMoments& cell : results_) lost += double{cell.lost[k]};
      if (lost > 0) continue;
      const PlanEstimate e{plans_.plans[k], variances[k], sample_cost(work, plans_.plans[k])};
      const double product = e.relative_variance * e.cost;
      if (best < 0 || product < kWorthIt * best) {
        best = product;
        report.chosen = e.plan;
      }
      report.estimates.push_back(e);
    }
    return report;
  }

  const RenderSettings settings_;
  const Renderer renderer_;
  const PlanSet plans_;
  const std::function<bool()>& go_on_;
  const CellRect grid_;
  int64_t samples_ = 0;
  std::vector<int64_t> cells_;
  std::vector<CellMoments> results_;
  RenderCounters counters_;
  SampleWork work_;
  std::atomic<size_t> next_{0};
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;
  std::exception_ptr failure_;
};

}  // namespace

PilotReport run_pilot(const Renderer& renderer, int threads, const std::function<bool()>& go_on) {
  RenderSettings settings = renderer.settings();
  settings.plan.reset();
  if (settings.max_depth < 1 || !renderer.plan().useful) {
    // Emitters alone are seen, or nothing shines.
    PilotReport report;
    settings.plan = SamplingPlan{.strategies = kEmissionHits};
    report.chosen = plan_of(settings);
    return report;
  }
  return Pilot(renderer, go_on).run(threads);
}

}  // namespace lightmill
