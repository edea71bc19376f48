#include "common/job/sampling_plan.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

#include "common/base/error.h"
#include "common/base/json/json_aliases.h"

namespace lightmill {
namespace {

void check_count(double count, std::span<const double> allowed, const char* what) {
  if (std::find(allowed.begin(), allowed.end(), count) != allowed.end()) return;
  std::string list;
  for (double x : allowed) list += (list.empty() ? "" : ", ") + nlohmann::json(x).dump();
  throw Error(ErrorKind::kUsage, std::string("sampling plan: ") + what + " must be one of " + list +
                                     ", not " + nlohmann::json(count).dump());
}

}  // namespace

void check_plan(const SamplingPlan& plan) {
  if (plan.strategies == 0 || plan.strategies > kAllStrategies)
    throw Error(ErrorKind::kUsage, "sampling plan: at least one strategy must run");
  check_count(plan.light_paths, kLightPathCounts, "light_paths");
  check_count(plan.connections, kConnectionCounts, "connections");
  check_count(plan.light_tracing_weight, kLightTracingWeights, "light_tracing_weight");
  if (plan.rr_depth < kLeastRrDepth || plan.rr_depth > kMostRrDepth) {
    throw Error(ErrorKind::kUsage,
                "sampling plan: rr_depth must be 2 or 3, not " + std::to_string(plan.rr_depth));
  }
  check_allocation(plan.allocation);
}

std::string plan_to_json(const SamplingPlan& plan) {
  nlohmann::json j = {{"connections", plan.connections},
                      {"light_paths", plan.light_paths},
                      {"strategies", strategy_names(plan.strategies)}};
  if (plan.guided_emission) j["guided_emission"] = *plan.guided_emission;
  if (plan.light_tracing_weight != 1) j["light_tracing_weight"] = plan.light_tracing_weight;
  if (plan.rr_depth != SamplingPlan().rr_depth) j["rr_depth"] = plan.rr_depth;
  if (!plan.allocation.uniform()) j["sample_allocation"] = plan.allocation.levels;
  return j.dump();
}

SamplingPlan plan_from_json(const std::string& text) {
  try {
    auto j = nlohmann::json::parse(text);
    take_older_keys(&j);
    if (j.size() != 3u + j.contains("guided_emission") + j.contains("sample_allocation") +
                        j.contains("light_tracing_weight") + j.contains("rr_depth")) {
      throw Error(ErrorKind::kUsage,
                  "sampling plan: expected are connections, light_paths and strategies, and no others than "
                  "guided_emission, light_tracing_weight, rr_depth and sample_allocation");
    }
    SamplingPlan plan;
    plan.strategies = strategies_named(j.at("strategies").get<std::string>());
    plan.light_paths = j.at("light_paths").get<double>();
    plan.connections = j.at("connections").get<double>();
    if (j.contains("guided_emission")) plan.guided_emission = j.at("guided_emission").get<bool>();
    if (j.contains("light_tracing_weight"))
      plan.light_tracing_weight = j.at("light_tracing_weight").get<double>();
    if (j.contains("rr_depth")) plan.rr_depth = j.at("rr_depth").get<int>();
    if (j.contains("sample_allocation"))
      plan.allocation.levels = j.at("sample_allocation").get<std::string>();
    check_plan(plan);
    return plan;
  } catch (const nlohmann::json::exception& e) {
    throw Error(ErrorKind::kUsage, std::string("the sampling plan is malformed: ") + e.what());
  }
}

}  // namespace lightmill
