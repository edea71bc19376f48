#pragma once
// An exact sum of splats and where it lies.
#include <cstdint>

#include "common/film/exact_sum.h"

namespace lightmill {

struct SplatSum {
  uint32_t pixel;  // y * width + x of the uncropped film
  ExactRgb sum;
  bool operator==(const SplatSum&) const = default;
};

}  // namespace lightmill
