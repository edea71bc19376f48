#include "tests/statistical/error/error_coverage.h"

#include <algorithm>
#include <atomic>
#include <thread>

#include "common/error/checkpoints.h"
#include "common/error/error_curve.h"
#include "common/film/film.h"

namespace lightmill::test {
namespace {

/// A run at its checkpoints.
struct Run {
  std::vector<ErrorPoint> points;
  std::vector<Image> images;
};

Run render_run(const ErrorScene& scene, uint64_t seed, int64_t superblocks) {
  SuperblockRenderer renderer(scene, seed);
  BatchFilm batches(scene.settings.grid);
  Film film(scene.settings.grid);
  Run run;
  for (int64_t i = 0; i < superblocks; ++i) {
    const Partial partial = renderer.render(i);
    batches.fold(partial);
    film.fold(partial);
    const int64_t spp = kSuperblockSamples * (i + 1);
    if (next_checkpoint(spp - 1) != spp && i + 1 < superblocks) continue;
    ErrorPoint point;
    point.spp = static_cast<double>(spp);
    batches.estimate(&point);
    run.points.push_back(point);
    run.images.push_back(film.resolve());
  }
  return run;
}

std::vector<Run> render_runs(const ErrorScene& scene, int runs, int64_t superblocks, uint64_t first_seed,
                             int threads) {
  std::vector<Run> result(static_cast<size_t>(runs));
  std::atomic<size_t> next{0};
  const auto work = [&] {
    for (size_t i; (i = next++) < result.size();) result[i] = render_run(scene, first_seed + i, superblocks);
  };
  std::vector<std::thread> pool;
  for (int t = 1; t < threads; ++t) pool.emplace_back(work);
  work();
  for (std::thread& t : pool) t.join();
  return result;
}

/// Fills true_relmse of every point. The reference of a run is the mean of the others' last images; its noise
/// adds N/((runs - 1) N_last) to the error of N samples in the mean, which is taken off.
void judge(std::vector<Run>* runs) {
  std::vector<double> total(runs->front().images.back().data.size());
  for (const Run& run : *runs) {
    for (size_t i = 0; i < total.size(); ++i) total[i] += static_cast<double>(run.images.back().data[i]);
  }
  const auto others = static_cast<double>(runs->size() - 1);
  for (Run& run : *runs) {
    for (size_t k = 0; k < run.points.size(); ++k) {
      double sum = 0;
      for (size_t i = 0; i < total.size(); ++i) {
        const double r = (total[i] - static_cast<double>(run.images.back().data[i])) / others;
        const double d = static_cast<double>(run.images[k].data[i]) - r;
        sum += d * d / (r * r + 1e-2);
      }
      const double noise = run.points[k].spp / (others * run.points.back().spp);
      run.points[k].true_relmse = sum / static_cast<double>(total.size()) / (1 + noise);
    }
  }
}

CheckpointCoverage coverage_at(const std::vector<Run>& runs, size_t k) {
  CheckpointCoverage c;
  double estimate = 0, truth = 0, width = 0;
  for (const Run& run : runs) {
    const ErrorPoint& p = run.points[k];
    c.spp = static_cast<int64_t>(p.spp);
    c.batches = p.batches;
    estimate += p.relmse.value_or(0);
    truth += *p.true_relmse;
    if (!p.relmse_low) continue;
    ++c.runs;
    c.covered += *p.relmse_low <= *p.true_relmse && *p.true_relmse <= *p.relmse_high;
    width += *p.relmse_high - *p.relmse;
  }
  if (estimate > 0) {
    c.bias = estimate / truth - 1;
    c.width = width / estimate;
  }
  return c;
}

StopRule stop_rule(const std::vector<Run>& runs, int64_t needed) {
  StopRule rule;
  rule.needed = needed;
  for (const Run& run : runs) {
    const auto at = std::find_if(run.points.begin(), run.points.end(),
                                 [&](const ErrorPoint& p) { return p.spp >= static_cast<double>(needed); });
    rule.target +=
        *at->true_relmse * at->spp / static_cast<double>(needed) / static_cast<double>(runs.size());
  }
  std::vector<double> samples;
  for (const Run& run : runs) {
    const auto at = std::find_if(run.points.begin(), run.points.end(),
                                 [&](const ErrorPoint& p) { return meets_target(p, rule.target); });
    ++rule.runs;
    if (at == run.points.end()) {
      ++rule.unfinished;
      ++rule.kept;
      samples.push_back(run.points.back().spp / static_cast<double>(needed));
    } else {
      rule.kept += *at->true_relmse < rule.target;
      samples.push_back(at->spp / static_cast<double>(needed));
    }
  }
  std::nth_element(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 2),
                   samples.end());
  rule.median_samples = samples[samples.size() / 2];
  return rule;
}

}  // namespace

CoverageResult measure_coverage(const ErrorScene& scene, int runs, int64_t superblocks, int64_t needed,
                                int threads, uint64_t first_seed) {
  std::vector<Run> all = render_runs(scene, runs, superblocks, first_seed, threads);
  judge(&all);
  CoverageResult result;
  for (size_t k = 0; k < all.front().points.size(); ++k) result.checkpoints.push_back(coverage_at(all, k));
  result.stop = stop_rule(all, needed * kSuperblockSamples);
  return result;
}

}  // namespace lightmill::test
