#pragma once
// Predicts what a sampling plan costs, from counted work. A pure function: the choice of a plan does not
// depend on the machine or its load.
#include "common/job/pilot_report.h"

namespace lightmill {

/// Nominal CPU microseconds of one pixel sample under `plan`, in a scene of `primitives` primitives. The unit
/// costs were fitted to renders with this project's kernels by tests/bench/cost_model.
double sample_cost(const SampleWork& work, const SamplingPlan& plan);
/// The part of it that goes with the camera path. The rest goes with light paths.
double camera_cost(const SampleWork& work, const SamplingPlan& plan);
/// Shadow rays of one pixel sample under `plan`. `work` counts those of one light path and one connection
/// that roulette leaves under `plan`.
double shadow_rays(const SampleWork& work, const SamplingPlan& plan);

}  // namespace lightmill
