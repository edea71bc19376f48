#include "common/job/sampling_plan.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>

#include "common/base/error.h"

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
  check_count(plan.lens_weight, kLensWeights, "lens_weight");
  check_allocation(plan.allocation);
}

std::string plan_to_json(const SamplingPlan& plan) {
  nlohmann::json j = {{"connections", plan.connections},
                      {"light_paths", plan.light_paths},
                      {"strategies", strategy_names(plan.strategies)}};
  if (plan.guided_emission) j["aimed"] = *plan.guided_emission;
  if (plan.lens_weight != 1) j["lens_weight"] = plan.lens_weight;
  if (!plan.allocation.uniform()) j["effort"] = plan.allocation.levels;
  return j.dump();
}

SamplingPlan plan_from_json(const std::string& text) {
  try {
    const auto j = nlohmann::json::parse(text);
    if (j.size() != 3u + j.contains("aimed") + j.contains("effort") + j.contains("lens_weight"))
      throw Error(ErrorKind::kUsage,
                  "sampling plan: exactly 3 fields, aimed, lens_weight and effort are expected");
    SamplingPlan plan;
    plan.strategies = strategies_named(j.at("strategies").get<std::string>());
    plan.light_paths = j.at("light_paths").get<double>();
    plan.connections = j.at("connections").get<double>();
    if (j.contains("aimed")) plan.guided_emission = j.at("aimed").get<bool>();
    if (j.contains("lens_weight")) plan.lens_weight = j.at("lens_weight").get<double>();
    if (j.contains("effort")) plan.allocation.levels = j.at("effort").get<std::string>();
    check_plan(plan);
    return plan;
  } catch (const nlohmann::json::exception& e) {
    throw Error(ErrorKind::kUsage, std::string("the sampling plan is malformed: ") + e.what());
  }
}

}  // namespace lightmill
