#pragma once
// The number of light paths, so that renderer and merger agree on it.
#include <algorithm>
#include <cstdint>

#include "common/job/sampling_plan.h"

namespace lightmill {

/// Light paths for one sample of each of `pixels` pixels: those of a cell within the crop window.
/// `light_paths`: SamplingPlan::light_paths of a plan with strategies that use them.
inline int light_paths_of_layer(double light_paths, int64_t pixels) {
  return std::max(1, static_cast<int>(light_paths * static_cast<double>(pixels) + 0.5));
}

}  // namespace lightmill
