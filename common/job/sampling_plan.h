#pragma once
// How a render spends its samples: which strategies run, and how many light paths and connections go with
// each camera path. Part of the settings: any plan is unbiased, and the same plan gives the same bytes.
#include <optional>
#include <string>

#include "common/job/sample_allocation.h"
#include "common/job/strategies.h"

namespace lightmill {

inline constexpr int kLeastRrDepth = 2, kMostRrDepth = 3;

struct SamplingPlan {
  Strategies strategies = kAllStrategies;
  /// Light paths per camera path: one of kLightPathCounts. Without a strategy that uses them none is traced.
  double light_paths = 1;
  /// Light paths, out of those of its packet, whose vertices a camera vertex is connected to on average: one
  /// of kConnectionCounts. Counts only with kVertexConnections.
  double connections = 1;
  /// In MIS weights light tracing counts as this times its number of light paths: one of
  /// kLightTracingWeights. Splats are shared by pixels, and so are less noisy than samples of single pixels.
  /// But they fall at random, and are noise where camera samples find the same light evenly. Counts only with
  /// kLightTracing.
  double light_tracing_weight = 1;
  /// Light paths use the emission guide, if the scene has one
  /// (worker/render/guiding/training/emission_guide_training.h). Else they choose lights by power, and
  /// directions as the lights shine. Not given: used from a certain gain on (kEmissionGuidePays there).
  std::optional<bool> guided_emission = {};
  /// Where camera samples go. Light paths have no pixel: everywhere there are `light_paths` of them.
  SampleAllocation allocation = {};
  /// The first scattering event of a camera path that plays Russian roulette: kLeastRrDepth to kMostRrDepth.
  /// Later is better in the open, where few paths go on for long anyway and roulette is noise that no
  /// sequence mends.
  int rr_depth = kLeastRrDepth;

  bool operator==(const SamplingPlan&) const = default;
};

inline constexpr double kLightPathCounts[] = {0.125, 0.25, 0.5, 1, 2};
inline constexpr double kConnectionCounts[] = {0.25, 0.5, 1, 2, 4, 8};
inline constexpr double kLightTracingWeights[] = {0.125, 1, 3};

/// Throws Error(kUsage) for a count that is not in the lists above, no strategy, or an allocation out of
/// range.
void check_plan(const SamplingPlan& plan);

/// JSON with sorted keys: {"connections": 1, "light_paths": 0.5, "strategies":
/// "hit,next-event,light-tracing"}. Also "guided_emission": false if it is given, "sample_allocation":
/// "0122..." unless it is uniform, "light_tracing_weight": 0.125 unless it is 1, and "rr_depth": 3 unless it
/// is 2.
std::string plan_to_json(const SamplingPlan& plan);
/// Inverse. Throws Error(kUsage) if it is malformed or a value is out of range.
SamplingPlan plan_from_json(const std::string& json);

}  // namespace lightmill
