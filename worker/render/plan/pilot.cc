#include "worker/render/plan/pilot.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "common/error.h"
#include "common/parallel.h"
#include "worker/render/pipeline/strategy_recorder.h"
#include "worker/render/plan/cost_model.h"
#include "worker/render/plan/effort.h"
#include "worker/render/plan/plan_moments.h"
#include "worker/render/sampling/sobol.h"

namespace lightmill {
namespace {

/// Camera paths that a pilot traces at most, and samples per pixel of the cells that it takes.
constexpr int64_t kPilotPaths = int64_t{1} << 18;
constexpr int64_t kLeastSamples = 2, kMostSamples = 32;
/// Of large images it looks at one of so many pixels at least, beyond that at fewer cells.
constexpr uint32_t kMostThinned = 64;
/// The pilot's samples are not those of the image, which they would bias.
constexpr uint64_t kPilotSeed = 0x70696c6f74;
/// Blocks of samples of one pixel are stratified in the camera layer, which lowers its variance by about this
/// factor against independent ones; splats gain next to nothing (measured by tests/bench/error_time).
constexpr double kStratification = 1.4;
/// Smallest gain for which a plan with more strategies is preferred.
constexpr double kWorthIt = 0.98;

/// Plans without which nothing is lost in this scene. One holds for the whole image: connections chosen for
/// each region of 8 pixels from one half of its pixels would gain 1.00 to 1.08 on the other half (seven of
/// nine scenes; on water-caustic one half loses 1.2), which is less than the bound of 1.1 that would be worth
/// a map.
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

/// What is looked at: cells, pixels of them, samples of these.
struct Sight {
  int64_t samples = kLeastSamples;
  uint32_t one_in = 1;
  std::vector<int64_t> cells;

  explicit Sight(const FilmGrid& grid) {
    const int64_t pixels = grid.crop.area(), count = grid.cells().count();
    while (samples < kMostSamples && 2 * samples * pixels <= kPilotPaths) samples *= 2;
    while (one_in < kMostThinned && samples * pixels > kPilotPaths * one_in) one_in *= 2;
    cells = pilot_cells(count, std::min(count, kPilotPaths * one_in / (samples * kCellPixels)));
  }
};

class Pilot {
 public:
  Pilot(const Renderer& scene, const std::function<bool()>& go_on)
      : settings_(pilot_settings(scene.settings())),
        sight_(settings_.grid),
        renderer_(scene, settings_, sight_.one_in),
        plans_(candidates(renderer_.plan())),
        go_on_(go_on),
        grid_(settings_.grid.cells()),
        regions_(regions_of(settings_.grid)),
        results_(sight_.cells.size()) {}

  PilotReport run(int threads) {
    parallel_for(static_cast<size_t>(threads), threads, [this](size_t) { work(); });
    if (failure_) std::rethrow_exception(failure_);
    if (stopped_) throw Error(ErrorKind::kFailed, "the pilot was interrupted");
    merge();
    add_splats();
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
      MomentRecorder moments(plans_, std::min(regions_.side, kCellSize));
      for (size_t i; !stopped_ && (i = next_++) < results_.size();) {
        if (!go_on_()) stopped_ = true;
        const CellRect rect = rect_of(sight_.cells[i]);
        CellResult& result = results_[i];
        moments.begin_cell();
        for (int64_t s = 0; s < sight_.samples; ++s) {
          result.counters +=
              renderer_.record_packet({rect.x0, rect.y0, s, s + 1}, *workspace, nullptr, *recorder);
          moments.add_sample(recorder->contributions);
          result.work += take_work(recorder.get());
        }
        std::array<bool, kCellPixels> inside{}, looked_at{};
        const PixelRect pixels = settings_.grid.pixels(rect);
        for (int slot = 0; slot < kCellPixels; ++slot) {
          const int x = rect.x0 * kCellSize + slot % kCellSize, y = rect.y0 * kCellSize + slot / kCellSize;
          const auto k = static_cast<size_t>(slot);
          inside[k] = x >= pixels.x0 && x < pixels.x1 && y >= pixels.y0 && y < pixels.y1;
          const auto pixel = static_cast<uint64_t>(y) * static_cast<uint64_t>(settings_.grid.width) +
                             static_cast<uint64_t>(x);
          looked_at[k] = inside[k] && is_looked_at(pixel, sight_.one_in);
        }
        result.moments = moments.end_cell(inside, looked_at);
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
      stopped_ = true;
    }
  }

  /// The work since the last call, which also forgets the contributions.
  static SampleWork take_work(StrategyRecorder* recorder) {
    SampleWork work;
    for (size_t s = 0; s < recorder->counts.size(); ++s) {
      for (size_t t = 0; t < recorder->counts.size(); ++t) {
        const StrategyCounts& c = recorder->counts[s][t];
        const auto rays = static_cast<double>(c.occluded + c.visible);
        if (t == 1) {
          work.lens_rays += rays;
        } else if (s > 0) {
          (s == 1 ? work.next_event_rays : work.connection_rays) += rays;
        }
      }
    }
    work.camera_hits = static_cast<double>(recorder->camera_hits);
    work.light_hits = static_cast<double>(recorder->light_hits);
    recorder->counts = {};
    recorder->camera_hits = recorder->light_hits = 0;
    recorder->clear();
    return work;
  }

  /// Adds up cells in their order, whoever rendered them.
  void merge() {
    noise_.resize(static_cast<size_t>(regions_.count()));
    camera_work_.resize(noise_.size());
    camera_paths_.resize(noise_.size());
    const int side = std::min(regions_.side, kCellSize), columns = kCellSize / side;
    for (size_t i = 0; i < results_.size(); ++i) {
      CellResult& from = results_[i];
      counters_ += from.counters;
      work_ += from.work;
      const CellRect rect = rect_of(sight_.cells[i]);
      for (size_t b = 0; b < from.moments.blocks.size(); ++b) {
        const int x = rect.x0 * kCellSize + static_cast<int>(b) % columns * side,
                  y = rect.y0 * kCellSize + static_cast<int>(b) / columns * side;
        const BlockMoments& block = from.moments.blocks[b];
        if (block.pixels[0] + block.pixels[1] == 0) continue;
        const auto r = static_cast<size_t>(regions_.at(x, y));
        noise_[r] += block;
        // Work is known per cell.
        camera_work_[r] += from.work;
        camera_paths_[r] += static_cast<double>(from.counters.camera_paths);
      }
      from.moments.blocks.clear();
    }
  }

  /// Splats land anywhere: each goes to its region. One light path stands for all that the film has per unit
  /// of spp.
  void add_splats() {
    const float scale = counters_.light_paths == 0
                            ? 0
                            : static_cast<float>(static_cast<double>(settings_.grid.light_paths_per_spp()) /
                                                 static_cast<double>(counters_.light_paths));
    const auto width = static_cast<uint32_t>(settings_.grid.width);
    for (CellResult& from : results_) {
      for (const RecordedSplat& splat : from.moments.splats) {
        const int x = static_cast<int>(splat.pixel % width), y = static_cast<int>(splat.pixel / width);
        BlockMoments& to = noise_[static_cast<size_t>(regions_.at(x, y))];
        add_splat(plans_, splat, half_of(x, y), scale, &to, &from.moments.lost);
      }
    }
  }

  /// 1 / (value^2 + 0.01) of a region's mean value: what relMSE weighs its variance with.
  static double relative_weight(const BlockMoments& block, size_t ch) {
    const double mean = double{block.mean[ch]} / block.all_looked_at();
    return 1 / (mean * mean + 0.01);
  }

  /// Mean over pixels and channels of variance / (value^2 + 0.01), per plan.
  std::array<double, kMaxPlans> relative_variances() const {
    std::array<double, kMaxPlans> sum{};
    double pixels = 0;
    for (const BlockMoments& block : noise_) {
      if (block.all_looked_at() == 0) continue;
      const double all = block.pixels[0] + block.pixels[1], share = all / block.all_looked_at();
      pixels += all;
      for (size_t ch = 0; ch < 3; ++ch) {
        const double weight = share * relative_weight(block, ch);
        for (size_t k = 0; k < kMaxPlans; ++k) {
          const double camera =
              std::max(0.0, double{block.camera[0][ch][k]} + double{block.camera[1][ch][k]});
          sum[k] += (camera / kStratification + double{block.splat[ch][k]}) * weight;
        }
      }
    }
    for (double& s : sum) s /= 3 * std::max(pixels, 1.0);
    return sum;
  }

  /// What the regions look like under plan number `k`.
  std::vector<RegionNoise> region_noise(size_t k) const {
    std::vector<RegionNoise> regions;
    for (size_t i = 0; i < noise_.size(); ++i) {
      const BlockMoments& block = noise_[i];
      RegionNoise& r = regions.emplace_back();
      r.pixels = block.pixels[0] + block.pixels[1];
      if (block.all_looked_at() == 0 || !(camera_paths_[i] > 0)) continue;
      for (size_t ch = 0; ch < 3; ++ch) {
        const double weight = relative_weight(block, ch) / 3;
        r.splat += weight * double{block.splat[ch][k]} / block.all_looked_at();
        for (size_t half = 0; half < 2; ++half) {
          const int looked_at = block.looked_at[half];
          if (looked_at == 0) continue;
          r.camera[half] +=
              weight * std::max(0.0, double{block.camera[half][ch][k]}) / (kStratification * looked_at);
          r.paths[half] = static_cast<double>(looked_at * sight_.samples);
        }
      }
      r.cost = camera_cost(per_path(camera_work_[i], camera_paths_[i]), plans_.plans[k]);
    }
    return regions;
  }

  SampleWork per_path(SampleWork work, double paths) const {
    for (double* w :
         {&work.camera_hits, &work.light_hits, &work.next_event_rays, &work.connection_rays, &work.lens_rays})
      *w /= std::max(paths, 1.0);
    work.primitives = static_cast<double>(renderer_.plan().primitives);
    return work;
  }

  PilotReport choose() {
    const auto variances = relative_variances();
    const SampleWork work = per_path(work_, static_cast<double>(counters_.camera_paths));
    PilotReport report;
    report.work = work;
    report.samples = static_cast<int64_t>(counters_.camera_paths);
    double best = -1;
    size_t chosen = 0;
    for (size_t k = 0; k < plans_.plans.size(); ++k) {
      double lost = 0;
      for (const CellResult& cell : results_) lost += double{cell.moments.lost[k]};
      if (lost > 0) continue;
      const PlanEstimate e{plans_.plans[k], variances[k], sample_cost(work, plans_.plans[k])};
      const double product = e.relative_variance * e.cost;
      if (best < 0 || product < kWorthIt * best) {
        best = product;
        report.chosen = e.plan;
        chosen = k;
      }
      report.estimates.push_back(e);
    }
    if (best >= 0 && !settings_.uniform_effort && report.chosen.strategies & kCameraLayer) {
      const SamplingPlan& plan = plans_.plans[chosen];
      const EffortChoice effort =
          choose_effort(regions_, region_noise(chosen), sample_cost(work, plan) - camera_cost(work, plan));
      report.chosen.effort = effort.map;
      report.effort_gain = effort.gain;
    }
    return report;
  }

  struct CellResult {
    CellMoments moments;
    SampleWork work;
    RenderCounters counters;
  };

  const RenderSettings settings_;
  const Sight sight_;
  const Renderer renderer_;
  const PlanSet plans_;
  const std::function<bool()>& go_on_;
  const CellRect grid_;
  const RegionGrid regions_;
  std::vector<CellResult> results_;
  // Of regions, all cells together.
  std::vector<BlockMoments> noise_;
  std::vector<SampleWork> camera_work_;
  std::vector<double> camera_paths_;
  RenderCounters counters_;
  SampleWork work_;
  std::atomic<size_t> next_{0};
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;  // of failure_
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
