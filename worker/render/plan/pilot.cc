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
#include "worker/render/plan/relative_weights.h"
#include "worker/render/sampling/sobol.h"

namespace lightmill {
namespace {

/// Camera paths that a pilot traces at most, and samples per pixel of the cells that it takes.
constexpr int64_t kPilotPaths = 3 << 16;
constexpr int64_t kLeastSamples = 2, kMostSamples = 32;
/// Of large images it looks at one of so many pixels at least, beyond that at fewer cells.
constexpr uint32_t kMostThinned = 64;
/// The pilot's samples are not those of the image, which they would bias.
constexpr uint64_t kPilotSeed = 0x70696c6f74, kFirstSeed = 0x6669727374;
/// The first of two blocks, of 16 samples in an image, half of the pilot's samples are taken from each of.
constexpr int64_t kPilotBlock = 5;
/// Blocks of samples of one pixel are stratified in the camera layer. A pilot that has two samples of a pixel
/// does not see what that gains; it is about this factor. Splats gain next to nothing
/// (tests/bench/plan_check).
constexpr double kStratification = 1.4;
/// Camera paths that the values come from, at least, by which relative variances are weighed.
constexpr double kLeastWeighed = 4;
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
  double paths_per_pixel() const { return static_cast<double>(samples) / one_in; }
  /// The look that only asks for values: where pixels are seen closely at the same samples, which then know
  /// their own part in them; else at a quarter of as many, of other random numbers.
  Sight first() const {
    Sight look = *this;
    if (!is_close()) look.samples = 1, look.one_in *= 2;
    return look;
  }
  bool is_close() const { return samples > kLeastSamples; }
  /// Sample index number `j` of those taken: half of them are of one block, half of the next.
  int block(int64_t j) const { return j < samples / 2 ? 0 : 1; }
  int64_t index(int64_t j) const {
    return block_begin(kPilotBlock + block(j)) + j - block(j) * (samples / 2);
  }
};

class Pilot {
 public:
  Pilot(const Renderer& scene, const std::function<bool()>& go_on)
      : settings_(pilot_settings(scene.settings(), kPilotSeed)),
        sight_(settings_.grid),
        first_(sight_.first()),
        renderer_(scene, settings_, sight_.one_in),
        plans_(candidates(renderer_.plan())),
        go_on_(go_on),
        grid_(settings_.grid.cells()),
        regions_(regions_of(settings_.grid)),
        values_(settings_.grid, first_.paths_per_pixel(), kLeastWeighed, sight_.is_close()),
        results_(sight_.cells.size()) {}

  PilotReport run(int threads) {
    take_turns(threads, &Pilot::look_first);
    weigh();
    take_turns(threads, &Pilot::work);
    merge();
    add_splats();
    count_rays();
    return choose();
  }

 private:
  static RenderSettings pilot_settings(RenderSettings settings, uint64_t seed) {
    settings.plan = SamplingPlan{.connections = kRecordedConnections};
    settings.seed ^= seed;
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

  /// What is seen at first, of which only values are asked.
  void look_first() {
    const Renderer renderer(renderer_, pilot_settings(settings_, sight_.is_close() ? 0 : kFirstSeed),
                            first_.one_in);
    const auto workspace = renderer.make_workspace();
    const auto recorder = std::make_unique<StrategyRecorder>();
    for (size_t i; take_cell(&i);) {
      const CellRect rect = rect_of(first_.cells[i]);
      CellResult& result = results_[i];
      for (int64_t j = 0; j < first_.samples; ++j) {
        const int64_t s = first_.index(j);
        result.first_light_paths +=
            renderer.record_packet({rect.x0, rect.y0, s, s + 1}, *workspace, nullptr, *recorder).light_paths;
        for (const StrategyContribution& c : recorder->contributions)
          result.first.push_back({c.pixel, {c.rgb[0], c.rgb[1], c.rgb[2]}, c.t == 1});
        recorder->clear();
        recorder->counts = {};
        recorder->camera_hits = recorder->light_hits = 0;
      }
    }
  }
  /// Values by which variances are weighed.
  void weigh() {
    uint64_t light_paths = 0;
    for (const CellResult& cell : results_) light_paths += cell.first_light_paths;
    // Of a pixel's samples; splats, over as many, stem from so many light paths.
    if (light_paths > 0)
      values_.set_per_splat(static_cast<double>(settings_.grid.light_paths_per_spp()) *
                            first_.paths_per_pixel() / static_cast<double>(light_paths));
    const auto width = static_cast<uint32_t>(settings_.grid.width);
    for (size_t i = 0; i < results_.size(); ++i) {
      const PixelRect pixels = settings_.grid.pixels(rect_of(first_.cells[i]));
      for (int y = pixels.y0; y < pixels.y1; ++y) {
        for (int x = pixels.x0; x < pixels.x1; ++x) values_.look_at(x, y);
      }
      for (const FirstValue& v : results_[i].first) {
        const int x = static_cast<int>(v.pixel % width), y = static_cast<int>(v.pixel / width);
        v.splat ? values_.add_splat(x, y, v.rgb) : values_.add_camera(x, y, v.rgb);
      }
      results_[i].first = {};
    }
    values_.finish();
  }
  std::array<PixelValue, kCellPixels> values_of(const CellRect& rect) const {
    std::array<PixelValue, kCellPixels> values{};
    const PixelRect pixels = settings_.grid.pixels(rect);
    for (int y = pixels.y0; y < pixels.y1; ++y) {
      for (int x = pixels.x0; x < pixels.x1; ++x)
        values[static_cast<size_t>((y - rect.y0 * kCellSize) * kCellSize + x - rect.x0 * kCellSize)] =
            values_.of(x, y);
    }
    return values;
  }

  CellRect rect_of(int64_t cell) const {
    const int64_t columns = grid_.x1 - grid_.x0;
    const int x = grid_.x0 + static_cast<int>(cell % columns),
              y = grid_.y0 + static_cast<int>(cell / columns);
    return {x, y, x + 1, y + 1};
  }

  /// The samples whose moments are taken.
  void work() {
    const auto workspace = renderer_.make_workspace();
    const auto recorder = std::make_unique<StrategyRecorder>();
    MomentRecorder moments(plans_, std::min(regions_.side, kCellSize));
    for (size_t i; take_cell(&i);) {
      const CellRect rect = rect_of(sight_.cells[i]);
      CellResult& result = results_[i];
      moments.begin_cell(values_of(rect));
      for (int64_t j = 0; j < sight_.samples; ++j) {
        const int64_t s = sight_.index(j);
        const RenderCounters counters =
            renderer_.record_packet({rect.x0, rect.y0, s, s + 1}, *workspace, nullptr, *recorder);
        result.counters += counters;
        moments.add_sample(recorder->contributions, sight_.block(j));
        result.work += take_work(recorder.get());
      }
      std::array<bool, kCellPixels> inside{}, looked_at{};
      const PixelRect pixels = settings_.grid.pixels(rect);
      for (int slot = 0; slot < kCellPixels; ++slot) {
        const int x = rect.x0 * kCellSize + slot % kCellSize, y = rect.y0 * kCellSize + slot / kCellSize;
        const auto k = static_cast<size_t>(slot);
        inside[k] = x >= pixels.x0 && x < pixels.x1 && y >= pixels.y0 && y < pixels.y1;
        const auto pixel =
            static_cast<uint64_t>(y) * static_cast<uint64_t>(settings_.grid.width) + static_cast<uint64_t>(x);
        looked_at[k] = inside[k] && is_looked_at(pixel, sight_.one_in);
      }
      result.moments = moments.end_cell(inside, looked_at);
    }
  }

  /// The work since the last call, which also forgets the contributions.
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
    work.camera_hits = static_cast<double>(recorder->camera_hits);
    work.light_hits = static_cast<double>(recorder->light_hits);
    work.connection_rays /= kRecordedConnections;
    work.connection_tries /= kRecordedConnections;
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
        add_splat(plans_, splat, values_.of(x, y), half_of(x, y), scale, &to, &from.moments);
      }
    }
  }

  /// What stratification gains beyond what the moments know.
  double stratification() const { return sight_.is_close() ? 1 : kStratification; }

  /// Mean over pixels and channels of variance / (value^2 + 0.01), per plan.
  std::array<double, kMaxPlans> relative_variances() const {
    std::array<double, kMaxPlans> sum{};
    double pixels = 0;
    for (const BlockMoments& block : noise_) {
      if (block.all_looked_at() == 0) continue;
      const double all = block.pixels[0] + block.pixels[1], share = all / block.all_looked_at();
      pixels += all;
      for (size_t ch = 0; ch < 3; ++ch) {
        for (size_t k = 0; k < kMaxPlans; ++k) {
          const double camera =
              std::max(0.0, double{block.camera[0][ch][k]} + double{block.camera[1][ch][k]});
          sum[k] += share * (camera / stratification() + double{block.splat[ch][k]});
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
        r.splat += double{block.splat[ch][k]} / (3 * block.all_looked_at());
        for (size_t half = 0; half < 2; ++half) {
          const int looked_at = block.looked_at[half];
          if (looked_at == 0) continue;
          r.camera[half] +=
              std::max(0.0, double{block.camera[half][ch][k]}) / (3 * stratification() * looked_at);
          r.paths[half] = static_cast<double>(looked_at * sight_.samples);
        }
      }
      r.cost = camera_cost(under_plan(k, per_path(camera_work_[i], camera_paths_[i])), plans_.plans[k]);
    }
    return regions;
  }

  /// Sums of what roulette leaves of each plan's shadow rays.
  void count_rays() {
    for (const CellResult& cell : results_) {
      next_event_rays_ += cell.moments.next_event;
      connection_rays_ += cell.moments.connect;
      lens_rays_ += cell.moments.lens;
    }
  }
  /// What plan number `k` makes of the shadow rays that were counted.
  SampleWork under_plan(size_t k, SampleWork work) const {
    work.next_event_rays *= next_event_rays_.share(k);
    work.connection_rays *= connection_rays_.share(k);
    work.lens_rays *= lens_rays_.share(k);
    return work;
  }

  SampleWork per_path(SampleWork work, double paths) const {
    for (double* w : {&work.camera_hits, &work.light_hits, &work.next_event_rays, &work.connection_rays,
                      &work.lens_rays, &work.next_event_tries, &work.connection_tries, &work.lens_tries})
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
      const SampleWork own = under_plan(k, work);
      const SamplingPlan& plan = plans_.plans[k];
      const PlanEstimate e{plan, variances[k], sample_cost(own, plan), shadow_rays(own, plan)};
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
      const SampleWork own = under_plan(chosen, work);
      const EffortChoice effort =
          choose_effort(regions_, region_noise(chosen), sample_cost(own, plan) - camera_cost(own, plan));
      report.chosen.effort = effort.map;
      report.effort_gain = effort.gain;
    }
    return report;
  }

  /// A contribution of the first look.
  struct FirstValue {
    uint32_t pixel;
    float rgb[3];
    bool splat;
  };
  struct CellResult {
    CellMoments moments;
    SampleWork work;
    RenderCounters counters;
    std::vector<FirstValue> first;  // until weigh()
    uint64_t first_light_paths = 0;
  };

  const RenderSettings settings_;
  const Sight sight_, first_;
  const Renderer renderer_;
  const PlanSet plans_;
  const std::function<bool()>& go_on_;
  const CellRect grid_;
  const RegionGrid regions_;
  RelativeWeights values_;
  std::vector<CellResult> results_;
  // Of regions, all cells together.
  std::vector<BlockMoments> noise_;
  std::vector<SampleWork> camera_work_;
  std::vector<double> camera_paths_;
  RenderCounters counters_;
  SampleWork work_;
  RayCounts next_event_rays_, connection_rays_, lens_rays_;
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
