#pragma once
// Chooses a plan from what a pilot recorded: the noise of every plan from moments, its cost from counted
// work.
#include <array>
#include <vector>

#include "common/job/pilot_report.h"
#include "common/job/sample_allocation.h"
#include "worker/render/plan/plan_moments.h"
#include "worker/render/plan/plan_set.h"

namespace lightmill {

/// What a pilot recorded in a region of the film.
struct RegionSums {
  BlockMoments noise;
  SampleWork camera_work;   // of its camera paths
  double camera_paths = 0;  // number of them
};

/// What a pilot recorded, all cells together.
struct PilotSums {
  std::vector<RegionSums> regions;
  SampleWork work;
  double camera_paths = 0;
  double hits_to_save = 0;  // StrategyRecorder::hits_to_save
  RayCounts next_event, connect, lens;
  std::array<double, kMaxPlans> lost{};    // light that a plan has no strategy for
  std::array<double, kMaxPlans> unseen{};  // unseen_variance
  PerPlan convergence{};                   // Convergence::ratio from the pilot's samples to the render's
};

/// How it was recorded.
struct PilotView {
  RegionGrid regions;
  int64_t samples = 0;      // per pilot pixel
  double primitives = 0;    // of the scene
  double splat_pixels = 1;  // of the pixel filter
};

/// `uniform_sampling`: the plan gets no sample allocation.
PilotReport choose_plan(const PlanSet& plans, const PilotView& view, const PilotSums& sums,
                        bool uniform_sampling);

}  // namespace lightmill
