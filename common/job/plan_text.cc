#include "common/job/plan_text.h"

#include <algorithm>
#include <cstdio>

namespace lightmill {
namespace {

/// The plan without its sample allocation, and without the counts that none of its strategies uses. The light
/// paths of all plans of a report are guided, or those of none. Each plan is there with its better roulette.
SamplingPlan canonical(SamplingPlan plan) {
  plan.allocation = {};
  plan.guided_emission = SamplingPlan().guided_emission;
  plan.rr_depth = SamplingPlan().rr_depth;
  if (!(plan.strategies & kLightPaths)) plan.light_paths = SamplingPlan().light_paths;
  if (!(plan.strategies & kVertexConnections)) plan.connections = SamplingPlan().connections;
  if (!(plan.strategies & kLightTracing)) plan.light_tracing_weight = SamplingPlan().light_tracing_weight;
  return plan;
}

const PlanEstimate* find(const PilotReport& report, const SamplingPlan& plan) {
  for (const PlanEstimate& e : report.estimates) {
    if (canonical(e.plan) == canonical(plan)) return &e;
  }
  return nullptr;
}

std::string count_text(double count) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", count);
  return text;
}

double work(const PlanEstimate& e) { return e.relative_variance * e.cost; }

}  // namespace

std::string plan_text(const SamplingPlan& plan) {
  std::string text = strategy_names(plan.strategies);
  if (plan.strategies & kLightPaths) {
    text += " × " + count_text(plan.light_paths);
    if (plan.guided_emission) text += *plan.guided_emission ? " guided" : " not guided";
  }
  if (plan.strategies & kVertexConnections) text += " × " + count_text(plan.connections) + " connections";
  if (plan.strategies & kLightTracing && plan.light_tracing_weight != 1)
    text += ", light tracing weight " + count_text(plan.light_tracing_weight);
  if (plan.rr_depth != SamplingPlan().rr_depth)
    text += ", roulette from event " + std::to_string(plan.rr_depth) + " on";
  if (!plan.allocation.uniform()) text += ", adaptive";
  return text;
}

std::vector<PlanEstimate> ranked_estimates(const PilotReport& report) {
  std::vector<PlanEstimate> list = report.estimates;
  std::stable_sort(list.begin(), list.end(),
                   [](const PlanEstimate& a, const PlanEstimate& b) { return work(a) < work(b); });
  const auto chosen = std::find_if(list.begin(), list.end(), [&](const PlanEstimate& e) {
    return canonical(e.plan) == canonical(report.chosen);
  });
  if (chosen != list.end()) std::rotate(list.begin(), chosen, chosen + 1);
  return list;
}

std::optional<double> predicted_gain(const PilotReport& report, const SamplingPlan& other) {
  const PlanEstimate *chosen = find(report, report.chosen), *compared = find(report, other);
  if (!chosen || !compared || !(work(*chosen) > 0)) return std::nullopt;
  return work(*compared) / work(*chosen);
}

SamplingPlan path_tracing_plan() { return {.strategies = kEmissionHits | kNextEvent}; }

}  // namespace lightmill
