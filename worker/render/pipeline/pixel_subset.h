#pragma once
// A subset of the film's pixels, for pilots and preview passes.
#include <bit>
#include <cstdint>

#include "worker/render/sampling/sobol.h"

namespace lightmill {

/// One pixel, drawn by hash, of every rectangle of `one_in` pixels, a power of two. So no place is left out,
/// as it could be if each pixel were drawn by itself, and the subset follows no pattern of the image.
struct PixelSubset {
  uint32_t one_in = 1;
  bool keeps(int x, int y) const {
    const int bits = std::countr_zero(one_in), wide = (bits + 1) / 2, high = bits / 2;
    const uint32_t column = static_cast<uint32_t>(x) >> wide, row = static_cast<uint32_t>(y) >> high;
    const uint32_t own =
        (static_cast<uint32_t>(y) - (row << high)) << wide | (static_cast<uint32_t>(x) - (column << wide));
    return (hash_combine(column, row) & (one_in - 1)) == own;
  }
};

}  // namespace lightmill
