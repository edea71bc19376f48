#pragma once
// Decides how many camera samples each region gets (adaptive sampling). For regions of variance V, cost C and
// p pixels, the variance sum p V / m at a given cost sum p m C is least for m ~ sqrt(V / C) (Neyman's
// allocation).
#include <vector>

#include "common/job/sample_allocation.h"

namespace lightmill {

/// What a pilot says about one region under the plan that it chose.
struct RegionNoise {
  double pixels = 0;          // in the crop window
  double paths[2] = {0, 0};   // camera paths of the pilot there, per half of the pixels
  double camera[2] = {0, 0};  // relative variance of one camera sample of a pixel, by each half
  double splat = 0;           // the same of splats, which the allocation leaves alone
  double cost = 0;            // of one camera sample
};

struct AllocationChoice {
  SampleAllocation map;  // uniform unless another is better
  double gain = 1;       // uniform variance x cost over that of the map
};

/// `light_cost`: cost of light paths per pixel and unit of spp. The gain is what maps made from one half of
/// the pilot's pixels achieve on the other half, so that maps don't follow the pilot's own noise.
AllocationChoice allocate_samples(const RegionGrid& grid, const std::vector<RegionNoise>& regions,
                                  double light_cost);

}  // namespace lightmill
