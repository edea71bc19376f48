#include "worker/render/plan/pilot.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <mutex>
#include <optional>

#include "common/base/error.h"
#include "common/base/parallel.h"
#include "common/job/replicates.h"
#include "worker/render/guiding/training/emission_guide_training.h"
#include "worker/render/pipeline/context.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/plan/convergence.h"
#include "worker/render/plan/cost_model.h"
#include "worker/render/plan/pilot_pixels.h"
#include "worker/render/plan/pilot_values.h"
#include "worker/render/plan/plan_choice.h"
#include "worker/render/plan/plan_moments.h"

namespace lightmill {
namespace {

/// The pilot's samples are not those of the image, which they would bias.
constexpr uint64_t kPilotSeed = 0x70696c6f74;
/// Two blocks of four show what stratification gains of smooth light: single samples show up to eight times
/// the noise. With 16 samples, fewer places are left than a choice needs.
constexpr int64_t kLeastSamples = 8;
/// The pilot's part of the job's camera paths, and least paths.
constexpr int64_t kPartOfJob = 32, kLeastPaths = 3 << 15;
/// For this many of its paths the pilot samples a pixel deeply besides, with a quarter as many.
constexpr int64_t kPathsOfDeepPixel = 4 * kReplicates * kMeasuredLengths.back();
/// Camera paths of each of the two preview passes that tell whether the emission guide pays, and the
/// predicted gain from which on it does: where 1.15 to 1.5 is predicted 1.27 to 1.47 was measured, where 0.94
/// to 1.1 (four rooms) 0.88 to 0.97, as guided light paths take longer.
constexpr int64_t kEmissionGuidePaths = kMostPilotPaths / 8;
constexpr double kEmissionGuideWorthIt = 1.12;

class Pilot {
 public:
  /// Records and weighs strategies `among` those that the scene allows, with light paths by the emission
  /// guide if `guided_emission`.
  Pilot(const Renderer& scene, Strategies among, std::optional<bool> guided_emission, int64_t paths,
        const std::function<bool()>& go_on)
      : settings_(pilot_settings(scene, among, guided_emission)),
        pilot_pixels_(settings_.grid, paths, kLeastSamples),
        renderer_(scene, settings_, pilot_pixels_.pixel_subset),
        plans_(candidate_plans(renderer_.plan(), among, guided_emission,
                               renderer_.context().filter.splat_noise,
                               1 / static_cast<float>(std::max(renderer_.context().lights.count(), 1)),
                               {static_cast<float>(pilot_pixels_.samples) / 2,
                                static_cast<float>(samples_of_replicate(settings_.spp))})),
        deep_pixels_(paths / kPathsOfDeepPixel),
        go_on_(go_on),
        regions_(regions_of(settings_.grid)),
        values_(settings_.grid, pilot_pixels_),
        results_(pilot_pixels_.cells.size()) {}

  PilotReport run(int threads) {
    take_turns(threads, &Pilot::look_first);
    values_.finish();
    sums_.convergence =
        measure_convergence(renderer_, settings_, plans_, values_, deep_pixels_, threads, go_on_)
            .ratio(double{plans_.lengths.render}, double{plans_.lengths.pilot});
    take_turns(threads, &Pilot::work);
    merge();
    add_splats();
    count();
    return choose_plan(plans_, view(), sums_, settings_.uniform_sampling);
  }

 private:
  struct CellResult {
    CellMoments moments;
    SampleWork work;
    std::vector<SampleWork> paths_of_blocks;
    double hits_to_save = 0;
    RenderCounters counters;
  };

  static RenderSettings pilot_settings(const Renderer& scene, Strategies among,
                                       std::optional<bool> guided_emission) {
    RenderSettings settings = scene.settings();
    settings.plan = SamplingPlan{.strategies = scene.plan().possible & among,
                                 .connections = kRecordedConnections,
                                 .guided_emission = guided_emission,
                                 .rr_depth = kMostRrDepth};
    settings.seed ^= kPilotSeed;
    return settings;
  }

  /// Runs `part`, which takes one cell after another, on all threads.
  void take_turns(int threads, void (Pilot::*part)()) {
    next_ = 0;
    parallel_for(static_cast<size_t>(threads), threads, [&](size_t) {
      try {
        (this->*part)();
      } catch (...) {
        const std::lock_guard lock(mutex_);
        failure_ = std::current_exception();
        stopped_ = true;
      }
    });
    if (failure_) std::rethrow_exception(failure_);
    if (stopped_) throw Error(ErrorKind::kFailed, "the pilot was interrupted");
  }
  /// The next cell that nobody has taken, if there is one.
  bool take_cell(size_t* i) {
    if (stopped_ || (*i = next_++) >= results_.size()) return false;
    if (!go_on_()) stopped_ = true;
    return true;
  }

  /// A first pass over the samples of work(), for the pixels' values alone: the moments are then weighed by
  /// these.
  void look_first() {
    const auto workspace = renderer_.make_workspace();
    const auto recorder = std::make_unique<StrategyRecorder>();
    for (size_t i; take_cell(&i);) {
      const CellRect rect = pilot_pixels_.rect(i);
      CellPreview preview;
      for (int64_t j = 0; j < pilot_pixels_.samples; ++j) {
        const int64_t s = pilot_pixels_.index(j);
        const RenderCounters counters =
            renderer_.record_packet({rect.x0, rect.y0, s, s + 1}, *workspace, nullptr, *recorder);
        preview.add(recorder->contributions, counters.light_paths);
        forget(recorder.get());
      }
      values_.take(i, std::move(preview));
    }
  }

  /// The second pass: the samples whose moments are taken.
  void work() {
    const auto workspace = renderer_.make_workspace();
    const auto recorder = std::make_unique<StrategyRecorder>();
    MomentRecorder moments(plans_, std::min(regions_.side, kCellSize));
    for (size_t i; take_cell(&i);) {
      const CellRect rect = pilot_pixels_.rect(i);
      CellResult& result = results_[i];
      std::array<bool, kCellPixels> inside{}, looked_at{};
      const PixelRect pixels = settings_.grid.pixels(rect);
      for (int slot = 0; slot < kCellPixels; ++slot) {
        const int x = rect.x0 * kCellSize + slot % kCellSize, y = rect.y0 * kCellSize + slot / kCellSize;
        const auto k = static_cast<size_t>(slot);
        inside[k] = x >= pixels.x0 && x < pixels.x1 && y >= pixels.y0 && y < pixels.y1;
        looked_at[k] = inside[k] && pilot_pixels_.pixel_subset.keeps(x, y);
      }
      moments.begin_cell(values_.of_cell(i));
      for (int64_t j = 0; j < pilot_pixels_.samples; ++j) {
        const int64_t s = pilot_pixels_.index(j);
        const RenderCounters counters =
            renderer_.record_packet({rect.x0, rect.y0, s, s + 1}, *workspace, nullptr, *recorder);
        result.counters += counters;
        moments.add_sample(recorder->contributions, recorder->survival_of_path, pilot_pixels_.block(j));
        result.hits_to_save += recorder->hits_to_save;
        add_work_of_paths(*recorder, looked_at, &result);
        result.work += take_work(recorder.get());
      }
      result.moments = moments.end_cell(inside, looked_at);
    }
  }

  /// Adds the work of camera paths, by blocks, from the pilot pixels.
  void add_work_of_paths(const StrategyRecorder& recorder, const std::array<bool, kCellPixels>& looked_at,
                         CellResult* result) const {
    const int side = std::min(regions_.side, kCellSize);
    result->paths_of_blocks.resize(block_of_slot(kCellPixels - 1, side) + 1);
    for (int slot = 0; slot < kCellPixels; ++slot) {
      if (!looked_at[static_cast<size_t>(slot)]) continue;
      SampleWork& block = result->paths_of_blocks[block_of_slot(slot, side)];
      block.camera_hits += recorder.hits_of_path[static_cast<size_t>(slot)];
      block.camera_steps += recorder.steps_of_path[static_cast<size_t>(slot)];
    }
  }
  /// Cost of the camera paths of block number `b` without their connections. A path that leaves the scene has
  /// cast one ray more than it has hits.
  double cost_of_paths(const CellResult& cell, size_t b) const {
    SampleWork work = cell.paths_of_blocks[b];
    work.camera_hits += static_cast<double>(cell.moments.blocks[b].all_previewed() * pilot_pixels_.samples);
    work.primitives = view().primitives;
    return camera_cost(work, {.strategies = kEmissionHits});
  }

  /// The work since the last call. Clears the recorded contributions as well.
  static SampleWork take_work(StrategyRecorder* recorder) {
    SampleWork work;
    for (size_t s = 0; s < recorder->counts.size(); ++s) {
      for (size_t t = 0; t < recorder->counts.size(); ++t) {
        const StrategyCounts& c = recorder->counts[s][t];
        const auto rays = static_cast<double>(c.occluded + c.visible),
                   tries = static_cast<double>(c.evaluated);
        if (t == 1) {
          work.lens_rays += rays;
          work.lens_tries += tries;
        } else if (s > 0) {
          (s == 1 ? work.next_event_rays : work.connection_rays) += rays;
          (s == 1 ? work.next_event_tries : work.connection_tries) += tries;
        }
      }
    }
    for (const uint32_t hits : recorder->hits_of_path) work.camera_hits += hits;
    for (const uint32_t steps : recorder->steps_of_path) work.camera_steps += steps;
    work.light_hits = static_cast<double>(recorder->light_hits);
    work.light_steps = static_cast<double>(recorder->light_steps);
    work.connection_rays /= kRecordedConnections;
    work.connection_tries /= kRecordedConnections;
    forget(recorder);
    return work;
  }
  static void forget(StrategyRecorder* recorder) {
    recorder->clear();
    recorder->counts = {};
    recorder->light_hits = recorder->light_steps = 0;
    recorder->hits_to_save = 0;
    recorder->hits_of_path = recorder->steps_of_path = {};
  }

  /// Adds up cells in their order, whichever thread rendered them.
  void merge() {
    sums_.regions.resize(static_cast<size_t>(regions_.count()));
    const int side = std::min(regions_.side, kCellSize), columns = kCellSize / side;
    for (size_t i = 0; i < results_.size(); ++i) {
      CellResult& from = results_[i];
      counters_ += from.counters;
      sums_.work += from.work;
      sums_.hits_to_save += from.hits_to_save;
      std::vector<double> costs;
      double all = 0;
      for (size_t b = 0; b < from.moments.blocks.size(); ++b) {
        costs.push_back(cost_of_paths(from, b));
        all += costs.back();
      }
      const CellRect rect = pilot_pixels_.rect(i);
      for (size_t b = 0; b < from.moments.blocks.size(); ++b) {
        const int x = rect.x0 * kCellSize + static_cast<int>(b) % columns * side,
                  y = rect.y0 * kCellSize + static_cast<int>(b) / columns * side;
        const BlockMoments& block = from.moments.blocks[b];
        if (block.pixels[0] + block.pixels[1] == 0) continue;
        RegionSums& to = sums_.regions[static_cast<size_t>(regions_.at(x, y))];
        to.noise += block;
        // All work is known per cell; it goes to the blocks by the cost of their paths.
        if (all > 0) to.camera_work += from.work.times(costs[b] / all);
        to.camera_paths += static_cast<double>(block.all_previewed() * pilot_pixels_.samples);
      }
      from.moments.blocks.clear();
    }
    sums_.camera_paths = static_cast<double>(counters_.camera_paths);
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
        BlockMoments& to = sums_.regions[static_cast<size_t>(regions_.at(x, y))].noise;
        add_splat(plans_, splat, values_.of(x, y), half_of(x, y), scale, &to, &from.moments);
      }
    }
  }

  /// The sums with what is known of cells once all splats are in.
  void count() {
    std::vector<const RarePaths*> rare;
    for (const CellResult& cell : results_) {
      sums_.next_event += cell.moments.next_event;
      sums_.connect += cell.moments.connect;
      sums_.lens += cell.moments.lens;
      for (size_t k = 0; k < kMaxPlans; ++k) sums_.lost[k] += double{cell.moments.lost[k]};
      rare.push_back(&cell.moments.rare);
    }
    sums_.unseen = unseen_variance(rare);
  }
  PilotView view() const {
    return {regions_, pilot_pixels_.samples, static_cast<double>(renderer_.plan().primitives),
            double{renderer_.context().filter.splat_pixels}};
  }

  const RenderSettings settings_;
  const PilotPixels pilot_pixels_;
  const Renderer renderer_;
  const PlanSet plans_;
  const int64_t deep_pixels_;
  const std::function<bool()>& go_on_;
  const RegionGrid regions_;
  PilotValues values_;
  std::vector<CellResult> results_;
  PilotSums sums_;
  RenderCounters counters_;
  std::atomic<size_t> next_{0};
  std::atomic<bool> stopped_{false};
  std::mutex mutex_;  // of failure_
  std::exception_ptr failure_;
};

double least_product(const std::vector<PlanEstimate>& estimates) {
  double least = std::numeric_limits<double>::infinity();
  for (const PlanEstimate& e : estimates) least = std::min(least, e.relative_variance * e.cost);
  return least;
}

/// Of the best plan with the emission guide over that without, by the same camera paths.
double gain_of_emission_guide(const Renderer& renderer, int threads, const std::function<bool()>& go_on) {
  const auto least = [&](bool guided_emission) {
    return least_product(
        Pilot(renderer, kAllStrategies, guided_emission, kEmissionGuidePaths, go_on).run(threads).estimates);
  };
  const double with = least(true), without = least(false);
  return with > 0 && without < std::numeric_limits<double>::infinity() ? without / with : 1;
}

}  // namespace

int64_t pilot_paths(const RenderSettings& settings) {
  const int64_t pixels = settings.grid.crop.area(), most = kMostPilotPaths * kPartOfJob;
  // Not as a product, which could overflow.
  return settings.spp >= most / pixels ? kMostPilotPaths
                                       : std::max(pixels * settings.spp / kPartOfJob, kLeastPaths);
}

PilotReport run_pilot(const Renderer& renderer, int threads, const std::function<bool()>& go_on,
                      std::optional<int64_t> wanted_paths) {
  RenderSettings settings = renderer.settings();
  settings.plan.reset();
  if (settings.max_depth < 1 || !renderer.plan().useful) {
    // Only emitters are visible, or nothing shines.
    PilotReport report;
    settings.plan = SamplingPlan{.strategies = kEmissionHits};
    report.chosen = plan_of(settings);
    return report;
  }
  const RenderScene& scene = renderer.context().scene;
  const int64_t paths = wanted_paths.value_or(pilot_paths(renderer.settings()));
  double emission_guide_gain = 1;
  std::optional<bool> guided_emission;
  if (scene.guided_lights && scene.emission_guide_gain < kEmissionGuidePays) {
    emission_guide_gain = gain_of_emission_guide(renderer, threads, go_on);
    guided_emission = emission_guide_gain >= kEmissionGuideWorthIt;
  }
  PilotReport report = Pilot(renderer, kAllStrategies, guided_emission, paths, go_on).run(threads);
  if (scene.manifolds.suffice()) {
    // Walks bring what light paths would. Samples without light paths tell it from more places.
    PilotReport walked = Pilot(renderer, kEmissionHits | kNextEvent, {}, paths, go_on).run(threads);
    const std::vector<PlanEstimate> estimates = std::move(walked.estimates);
    if (least_product(estimates) < least_product(report.estimates)) {
      walked.estimates = std::move(report.estimates);
      report = std::move(walked);
    }
    report.estimates.insert(report.estimates.end(), estimates.begin(), estimates.end());
  }
  report.emission_guide_gain = emission_guide_gain;
  return report;
}

}  // namespace lightmill
