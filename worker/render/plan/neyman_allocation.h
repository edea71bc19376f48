#pragma once
// Where camera samples are best spent: for regions of variance V, cost C and p pixels, sum p V / m at a given
// sum p m C is least for m = sqrt(V / C) (Neyman's allocation).
#include <vector>

#include "common/job/sample_allocation.h"

namespace lightmill {

/// What a pilot says about one region under the plan that it chose.
struct RegionNoise {
  double pixels = 0;          // in the crop window
  double paths[2] = {0, 0};   // camera paths of the pilot there, per half of the pixels
  double camera[2] = {0, 0};  // relative variance of one camera sample of a pixel, as each half sees it
  double splat = 0;           // the same of splats, which effort does not change
  double cost = 0;            // of one camera sample
};

struct AllocationChoice {
  SampleAllocation map;    // uniform unless something is gained
  double gain = 1;  // uniform effort's variance x cost over that of the map
};

/// `light_cost`: of light paths per pixel and unit of spp. The gain is what maps made from one half of the
/// pilot's pixels achieve on the other half, so that it is not the noise of the pilot that is followed.
AllocationChoice allocate_samples(const RegionGrid& grid, const std::vector<RegionNoise>& regions,
                           double light_cost);

}  // namespace lightmill
