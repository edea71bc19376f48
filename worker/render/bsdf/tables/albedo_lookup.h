#pragma once
// Bilinear look-up in a table of directional albedos: rows of kCosineNodes nodes, evenly spaced from 0 to 1
// over the cosine, kValues floats a node.
#include "worker/render/bsdf/tables/albedo_table.h"
#include "worker/render/math/lanes.h"

namespace lightmill {

template <class F, int kValues>
struct AlbedoLookup {
  /// `row` in [0, rows - 1]: where between the rows of `table`, of which there are at least two.
  AlbedoLookup(const float* table, int rows, F cosine, F row) : table_(table) {
    const F x = clamp(cosine, 0.0f, 1.0f) * static_cast<float>(kCosineNodes - 1);
    const IntOf<F> i = to_int(min(x, splat<F>(kCosineNodes - 2))),
                   j = to_int(min(row, splat<F>(static_cast<float>(rows - 2))));
    s_ = x - to_float(i);
    t_ = row - to_float(j);
    at_ = (j * kCosineNodes + i) * kValues;
  }
  /// Value number `k` of the nodes.
  F operator()(int k) const {
    const float* low = table_ + k;
    const float* high = low + kCosineNodes * kValues;
    const F a0 = gather(low, at_), a1 = gather(low + kValues, at_);
    const F b0 = gather(high, at_), b1 = gather(high + kValues, at_);
    const F below = a0 + (a1 - a0) * s_, above = b0 + (b1 - b0) * s_;
    return below + (above - below) * t_;
  }

 private:
  const float* table_;
  F s_, t_;
  IntOf<F> at_;
};

}  // namespace lightmill
