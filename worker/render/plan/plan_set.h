#pragma once
// The sampling plans that a pilot weighs against each other.
#include <array>
#include <optional>
#include <vector>

#include "common/job/sampling_plan.h"
#include "worker/render/plan/analysis/scene_plan.h"

namespace lightmill {

/// Most plans that are weighed against each other.
inline constexpr int kMaxPlans = 144;

/// A float per plan.
using PerPlan = std::array<float, kMaxPlans>;

/// Of the plan that is recorded, which has every strategy and one light path: of one connection nothing would
/// be seen of how two of a kind go together.
inline constexpr double kRecordedConnections = 2;

/// The plans under consideration, as factors on the samples of each family relative to the plan that is
/// recorded.
struct PlanSet {
  /// `splat_noise`: PixelFilter's. `light_share`: of the light paths, how many a light has.
  PlanSet(std::vector<SamplingPlan> candidates, float splat_noise, float light_share = 1);
  std::vector<SamplingPlan> plans;
  /// As MIS weights count them.
  PerPlan hit{}, next_event{}, lens{}, connect{};
  PerPlan light_tracing_weight{};
  /// Variance of splats over what as many camera samples as the weights take them for would leave.
  PerPlan splat_noise{};
  float light_share;
  /// Pairs of connections of one kind, camera and light vertex at given depths, over those recorded, beyond
  /// what independent draws would make of them; less 1.
  PerPlan more_pairs{};
};

/// Plans without which nothing is lost in this scene. One holds for the whole image: connections chosen for
/// each region of 8 pixels from one half of its pixels would gain 1.00 to 1.08 on the other half (seven of
/// nine scenes; on water-caustic one half loses 1.2), which is less than the bound of 1.1 that would be worth
/// a map.
/// None has other strategies than `among`; those with light paths are `aimed`.
PlanSet candidate_plans(const ScenePlan& scene, Strategies among, std::optional<bool> guided_emission,
                        float splat_noise, float light_share);

}  // namespace lightmill
