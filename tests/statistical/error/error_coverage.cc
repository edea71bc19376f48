#include "tests/statistical/error/error_coverage.h"

#include <algorithm>
#include <atomic>
#include <thread>

#include "common/error/batch_film.h"
#include "common/error/checkpoints.h"
#include "common/film/film.h"
#include "common/image/box_means.h"

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

/// relMSE against the mean of the other runs' last images, `total` less the run's own `last`.
double relmse_beside(const Image& image, const Image& last, const Image& total, size_t runs) {
  const auto others = static_cast<double>(runs - 1);
  double sum = 0;
  for (size_t i = 0; i < total.data.size(); ++i) {
    const double r = (static_cast<double>(total.data[i]) - static_cast<double>(last.data[i])) / others;
    const double d = static_cast<double>(image.data[i]) - r;
    sum += d * d / (r * r + 1e-2);
  }
  return sum / static_cast<double>(total.data.size());
}

/// Fills true_relmse of every point. The reference of a run is the mean of the others' last images; its noise
/// adds N/((runs - 1) N_last) to the error of N samples in the mean, which is taken off.
void judge(std::vector<Run>* runs) {
  Image total = runs->front().images.back();
  for (size_t k = 1; k < runs->size(); ++k) {
    for (size_t i = 0; i < total.data.size(); ++i) total.data[i] += (*runs)[k].images.back().data[i];
  }
  for (Run& run : *runs) {
    for (size_t k = 0; k < run.points.size(); ++k) {
      ErrorPoint& point = run.points[k];
      const Image &image = run.images[k], &last = run.images.back();
      const double noise = 1 + point.spp / (static_cast<double>(runs->size() - 1) * run.points.back().spp);
      point.true_relmse = relmse_beside(image, last, total, runs->size()) / noise;
      for (size_t b = 0; b < kBoxSides.size(); ++b) {
        const int side = kBoxSides[b];
        const Image boxes = box_means(image, side);
        if (boxes.data.empty()) continue;
        point.boxes[b].true_relmse =
            relmse_beside(boxes, box_means(last, side), box_means(total, side), runs->size()) * side * side /
            noise;
      }
    }
  }
}

Coverage coverage_of(const std::vector<BoxError>& errors) {
  Coverage c;
  double estimate = 0, truth = 0, width = 0;
  for (const BoxError& e : errors) {
    estimate += e.relmse.value_or(0);
    truth += e.true_relmse.value_or(0);
    if (!e.relmse_low) continue;
    ++c.runs;
    c.covered += *e.relmse_low <= *e.true_relmse && *e.true_relmse <= *e.relmse_high;
    width += *e.relmse_high - *e.relmse;
  }
  if (estimate > 0) {
    c.bias = estimate / truth - 1;
    c.width = width / estimate;
  }
  return c;
}

CheckpointCoverage coverage_at(const std::vector<Run>& runs, size_t k) {
  CheckpointCoverage c;
  std::vector<BoxError> pixels;
  std::array<std::vector<BoxError>, kBoxSides.size()> boxes;
  for (const Run& run : runs) {
    const ErrorPoint& p = run.points[k];
    c.spp = static_cast<int64_t>(p.spp);
    c.batches = p.batches;
    pixels.push_back({p.relmse, p.relmse_low, p.relmse_high, p.true_relmse});
    for (size_t b = 0; b < boxes.size(); ++b) boxes[b].push_back(p.boxes[b]);
  }
  c.pixels = coverage_of(pixels);
  for (size_t b = 0; b < boxes.size(); ++b) c.boxes[b] = coverage_of(boxes[b]);
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
