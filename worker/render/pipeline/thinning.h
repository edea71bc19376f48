#pragma once
// Which pixels a look at few of them is taken at.
#include <cstdint>

#include "worker/render/sampling/sobol.h"

namespace lightmill {

/// One in `one_in` squares of `side` pixels, both powers of two, drawn by hash.
struct Thinning {
  uint32_t one_in = 1;
  int side = 1;
  bool keeps(int film_width, int x, int y) const {
    const auto square =
        static_cast<uint64_t>(y / side) * static_cast<uint64_t>(film_width) + static_cast<uint64_t>(x / side);
    return (hash32(static_cast<uint32_t>(square)) & (one_in - 1)) == 0;
  }
};

}  // namespace lightmill
