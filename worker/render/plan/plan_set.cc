#include "worker/render/plan/plan_set.h"

#include <cmath>
#include <stdexcept>
#include <utility>

namespace lightmill {
namespace {

/// Ordered pairs among `picks` draws of systematic sampling, on average. It draws the whole number below or
/// above, where independent draws have picks^2 pairs.
double pairs_of(double picks) {
  const double whole = std::floor(picks);
  return whole * (whole - 1) + 2 * whole * (picks - whole);
}

}  // namespace

PlanSet::PlanSet(std::vector<SamplingPlan> candidates, float splat_noise_of_filter, float share,
                 const SequenceLengths& sequence_lengths)
    : plans(std::move(candidates)), light_share(share), lengths(sequence_lengths) {
  if (plans.size() > kMaxPlans) throw std::logic_error("too many sampling plans");
  light_tracing_weight.fill(1);
  for (size_t k = 0; k < plans.size(); ++k) {
    const SamplingPlan& p = plans[k];
    hit[k] = p.strategies & kEmissionHits ? 1.0f : 0.0f;
    next_event[k] = p.strategies & kNextEvent ? 1.0f : 0.0f;
    light_tracing_weight[k] = static_cast<float>(p.light_tracing_weight);
    splat_noise[k] = splat_noise_of_filter * light_tracing_weight[k];
    lens[k] = p.strategies & kLightTracing ? static_cast<float>(p.light_paths) * light_tracing_weight[k] : 0;
    connect[k] =
        p.strategies & kVertexConnections ? static_cast<float>(p.connections / kRecordedConnections) : 0;
    // The cache has about one vertex of each depth for each light path.
    const double own = pairs_of(p.connections) / (p.connections * p.connections),
                 recorded = pairs_of(kRecordedConnections) / (kRecordedConnections * kRecordedConnections);
    more_pairs[k] = static_cast<float>(own / recorded - 1);
  }
}

PerPlan PlanSet::density_ratio(const FamilyShares& shares) const {
  PerPlan factor;
  for (size_t k = 0; k < kMaxPlans; ++k) {
    const float density = shares.hit * hit[k] + shares.next_event * next_event[k] + shares.lens * lens[k] +
                          shares.connect * connect[k];
    factor[k] = density > 0 ? 1 / density : 0;
  }
  return factor;
}

PlanSet candidate_plans(const ScenePlan& scene, Strategies among, std::optional<bool> guided_emission,
                        float splat_noise, float light_share, const SequenceLengths& lengths) {
  std::vector<SamplingPlan> plans;
  const auto add = [&](Strategies set, double light_paths, double connections) {
    if (!scene.complete[set] || set & ~scene.possible || set & ~among) return;
    const std::optional<bool> own = set & kLightPaths ? guided_emission : std::nullopt;
    plans.push_back({set, light_paths, connections, 1, own});
    for (const double weight : kLightTracingWeights) {
      if (weight != 1 && set & kLightTracing) plans.push_back({set, light_paths, connections, weight, own});
    }
  };
  const Strategies base = scene.useful & (kEmissionHits | kNextEvent);
  add(base, 1, 1);
  if (base & kEmissionHits && base != kEmissionHits) add(kEmissionHits, 1, 1);
  for (const double light_paths : kLightPathCounts) {
    add(base | kLightTracing, light_paths, 1);
    for (const double connections : kConnectionCounts) {
      add(base | kVertexConnections, light_paths, connections);
      add(base | kLightTracing | kVertexConnections, light_paths, connections);
    }
  }
  return PlanSet(std::move(plans), splat_noise, light_share, lengths);
}

}  // namespace lightmill
