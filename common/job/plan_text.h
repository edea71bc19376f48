#pragma once
// Sampling plans and what a pilot predicts of them, for people.
#include <optional>
#include <string>
#include <vector>

#include "common/job/pilot_report.h"

namespace lightmill {

/// "hit,next-event,light-tracing × 0.5": the strategies and, if some use them, light paths per camera path.
/// Then, where vertices are connected, " × 2 connections"; and ", adaptive" where sampling is adaptive.
std::string plan_text(const SamplingPlan& plan);

/// The estimates: the chosen plan first, the others by rising relative variance × cost.
std::vector<PlanEstimate> ranked_estimates(const PilotReport& report);
/// The predicted variance × cost of `other` over that of the chosen plan. Empty if either was not estimated,
/// or if the chosen one is predicted to be free of noise. Counts that `other` does not use are ignored.
std::optional<double> predicted_gain(const PilotReport& report, const SamplingPlan& other);

/// Path tracing: hits and next event.
SamplingPlan path_tracing_plan();

}  // namespace lightmill
