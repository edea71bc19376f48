#include "worker/render/plan/plan_choice.h"

#include <algorithm>

#include "worker/render/plan/cost_model.h"
#include "worker/render/plan/neyman_allocation.h"

namespace lightmill {
namespace {

/// Smallest gain for which a plan with more strategies is preferred.
constexpr double kLeastImprovement = 0.98;

class Choice {
 public:
  Choice(const PlanSet& plans, const PilotView& view, const PilotSums& sums)
      : plans_(plans), view_(view), sums_(sums) {}

  PilotReport make(bool uniform_sampling) const {
    const Variances variances = relative_variances();
    const SampleWork work = per_path(sums_.work, sums_.camera_paths);
    PilotReport report;
    report.work = work;
    report.samples = static_cast<int64_t>(sums_.camera_paths);
    double best = -1;
    size_t chosen = 0;
    for (size_t k = 0; k < plans_.plans.size(); ++k) {
      if (sums_.lost[k] > 0) continue;
      PlanEstimate e = estimate(k, kMostRrDepth, variances, work);
      if (e.plan.strategies & kCameraLayer) {
        const PlanEstimate other = estimate(k, kLeastRrDepth, variances, work);
        if (product_of(other) <= product_of(e)) e = other;
      }
      const double product = product_of(e);
      if (best < 0 || product < kLeastImprovement * best) {
        best = product;
        report.chosen = e.plan;
        chosen = k;
      }
      report.estimates.push_back(e);
    }
    if (best >= 0 && !uniform_sampling && report.chosen.strategies & kCameraLayer) {
      const SamplingPlan& plan = report.chosen;
      const SampleWork own = under_plan(chosen, plan.rr_depth, work);
      const AllocationChoice allocation = allocate_samples(view_.regions, region_noise(chosen, plan.rr_depth),
                                                           sample_cost(own, plan) - camera_cost(own, plan));
      report.chosen.allocation = allocation.map;
      report.adaptive_gain = allocation.gain;
    }
    return report;
  }

 private:
  static double product_of(const PlanEstimate& e) { return e.relative_variance * e.cost; }

  /// Noise `camera` of the camera layer, as it is per sample of the render. Of that is `even` what sequences
  /// make more even; the rest is as it is for any number of samples. Both are estimates of their own.
  double in_render(size_t k, double camera, double even) const {
    constexpr double kMostGained = 0.95;
    camera = std::max(0.0, camera);
    return camera - std::min((1 - double{sums_.convergence[k]}) * even, kMostGained * camera);
  }

  /// Means over pixels and channels of variance / (value^2 + 0.01), per plan.
  struct Variances {
    std::array<double, kMaxPlans> late_roulette{};  // with rr_depth = kMostRrDepth, as it was recorded
    std::array<double, kMaxPlans> roulette{};       // what roulette at event kLeastRrDepth adds
  };

  /// What is predicted of plan number `k` with this roulette.
  PlanEstimate estimate(size_t k, int rr_depth, const Variances& variances, const SampleWork& work) const {
    SamplingPlan plan = plans_.plans[k];
    // Of light paths alone it says nothing.
    if (plan.strategies & kCameraLayer) plan.rr_depth = rr_depth;
    const SampleWork own = under_plan(k, rr_depth, work);
    const double variance =
        variances.late_roulette[k] + (rr_depth == kLeastRrDepth ? variances.roulette[k] : 0);
    return {plan, variance, sample_cost(own, plan), shadow_rays(own, plan)};
  }

  Variances relative_variances() const {
    std::array<double, kMaxPlans> camera{}, even{}, splat{}, roulette{};
    double pixels = 0, looked_at = 0;
    for (const RegionSums& region : sums_.regions) {
      const BlockMoments& block = region.noise;
      if (block.all_previewed() == 0) continue;
      const double all = block.pixels[0] + block.pixels[1], share = all / block.all_previewed();
      pixels += all, looked_at += block.all_previewed();
      // A region's variance may come out below 0, as a difference of moments; the sum of regions is unbiased.
      for (size_t ch = 0; ch < 3; ++ch) {
        for (size_t k = 0; k < kMaxPlans; ++k) {
          camera[k] += share * (double{block.camera[0][ch][k]} + double{block.camera[1][ch][k]});
          splat[k] += share * double{block.splat[ch][k]};
        }
      }
      for (size_t k = 0; k < kMaxPlans; ++k) {
        roulette[k] += share * (double{block.roulette[0][k]} + double{block.roulette[1][k]});
        even[k] += share * (double{block.even[0][k]} + double{block.even[1][k]});
      }
    }
    Variances result;
    for (size_t k = 0; k < kMaxPlans; ++k) {
      const double all =
          in_render(k, camera[k], even[k]) + splat[k] + sums_.unseen[k] * pixels / std::max(looked_at, 1.0);
      result.late_roulette[k] = all / (3 * std::max(pixels, 1.0));
      result.roulette[k] = roulette[k] / (3 * std::max(pixels, 1.0));
    }
    return result;
  }

  /// The noise of the regions under plan number `k` with this roulette.
  std::vector<RegionNoise> region_noise(size_t k, int rr_depth) const {
    std::vector<RegionNoise> regions;
    for (const RegionSums& region : sums_.regions) {
      const BlockMoments& block = region.noise;
      RegionNoise& r = regions.emplace_back();
      r.pixels = block.pixels[0] + block.pixels[1];
      if (block.all_previewed() == 0 || !(region.camera_paths > 0)) continue;
      std::array<double, 2> camera{};
      for (size_t ch = 0; ch < 3; ++ch) {
        r.splat += double{block.splat[ch][k]} / (3 * block.all_previewed());
        for (size_t half = 0; half < 2; ++half) {
          const int looked_at = block.looked_at[half];
          if (looked_at == 0) continue;
          camera[half] += double{block.camera[half][ch][k]};
          r.paths[half] = static_cast<double>(looked_at * view_.samples);
        }
      }
      for (size_t half = 0; half < 2; ++half) {
        if (block.looked_at[half] > 0)
          r.camera[half] =
              in_render(k, camera[half], double{block.even[half][k]}) / (3 * block.looked_at[half]);
      }
      if (rr_depth == kLeastRrDepth) {
        for (size_t half = 0; half < 2; ++half) {
          if (block.looked_at[half] > 0)
            r.camera[half] += double{block.roulette[half][k]} / (3 * block.looked_at[half]);
        }
      }
      r.cost = camera_cost(under_plan(k, rr_depth, per_path(region.camera_work, region.camera_paths)),
                           plans_.plans[k]);
    }
    return regions;
  }

  /// The part of the work of camera paths that is left with this roulette.
  double kept_by_roulette(int rr_depth) const {
    const double hits = sums_.work.camera_hits;
    return rr_depth == kMostRrDepth || !(hits > 0) ? 1 : 1 - sums_.hits_to_save / hits;
  }

  /// Replaces what was counted by the work of plan number `k` with this roulette.
  SampleWork under_plan(size_t k, int rr_depth, SampleWork work) const {
    const double kept = kept_by_roulette(rr_depth);
    for (double* w : {&work.camera_hits, &work.camera_steps, &work.next_event_rays, &work.next_event_tries,
                      &work.connection_rays, &work.connection_tries})
      *w *= kept;
    work.next_event_rays *= sums_.next_event.share(k);
    work.connection_rays *= sums_.connect.share(k);
    work.lens_rays *= sums_.lens.share(k);
    return work;
  }

  SampleWork per_path(SampleWork work, double paths) const {
    for (double* w : {&work.camera_hits, &work.light_hits, &work.next_event_rays, &work.connection_rays,
                      &work.lens_rays, &work.next_event_tries, &work.connection_tries, &work.lens_tries,
                      &work.camera_steps, &work.light_steps})
      *w /= std::max(paths, 1.0);
    work.primitives = view_.primitives;
    work.splat_pixels = view_.splat_pixels;
    return work;
  }

  const PlanSet& plans_;
  const PilotView& view_;
  const PilotSums& sums_;
};

}  // namespace

PilotReport choose_plan(const PlanSet& plans, const PilotView& view, const PilotSums& sums,
                        bool uniform_sampling) {
  return Choice(plans, view, sums).make(uniform_sampling);
}

}  // namespace lightmill
