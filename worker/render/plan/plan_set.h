#pragma once
// The sampling plans that a pilot compares.
#include <array>
#include <optional>
#include <vector>

#include "common/job/sampling_plan.h"
#include "worker/render/pipeline/recording/strategy_recorder.h"
#include "worker/render/plan/analysis/scene_plan.h"

namespace lightmill {

/// Most plans that are compared.
inline constexpr int kMaxPlans = 144;

/// A float per plan.
using PerPlan = std::array<float, kMaxPlans>;

/// Connections of the plan that is recorded, which has every strategy and one light path. A single connection
/// would not show how two of a kind vary together.
inline constexpr double kRecordedConnections = 2;

/// Samples of one low-discrepancy sequence that a pixel has: where the pilot records its noise, and in the
/// render.
struct SequenceLengths {
  float pilot = 4, render = 16;
};

/// The plans under consideration, as factors on the samples of each family relative to the recorded plan.
struct PlanSet {
  /// `splat_noise`: PixelFilter's. `light_share`: the part of the light paths that one light has.
  PlanSet(std::vector<SamplingPlan> candidates, float splat_noise, float light_share = 1,
          const SequenceLengths& lengths = {});
  std::vector<SamplingPlan> plans;
  /// As MIS weights count them.
  PerPlan hit{}, next_event{}, lens{}, connect{};
  PerPlan light_tracing_weight{};
  /// Variance of splats, over that of as many camera samples as the MIS weights take them for.
  PerPlan splat_noise{};
  float light_share;
  SequenceLengths lengths;
  /// Pairs of connections of one kind (camera and light vertex at given depths) beyond what independent draws
  /// would make, over those of the recorded plan; less 1.
  PerPlan more_pairs{};

  /// Per plan: the sum of n_j p_j of the recorded plan over that of the plan, by which a contribution with
  /// these shares is to be multiplied. 0 where the plan has no strategy for the path.
  PerPlan density_ratio(const FamilyShares& shares) const;
};

/// The plans that lose no light in this scene. None has other strategies than `among`; those with light paths
/// have `guided_emission`.
///
/// A plan holds for the whole image. Connections chosen for each region of 8 pixels from one half of its
/// pixels would gain 1.00 to 1.08 on the other half (seven of nine scenes; on water-caustic one half loses
/// 1.2). That is less than the bound of 1.1 from which a map would be worth it.
PlanSet candidate_plans(const ScenePlan& scene, Strategies among, std::optional<bool> guided_emission,
                        float splat_noise, float light_share, const SequenceLengths& lengths);

}  // namespace lightmill
