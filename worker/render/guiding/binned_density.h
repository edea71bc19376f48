#pragma once
// Draws texels of a square image in two steps: a bin by one of many tables of probabilities, then a texel of
// the bin by its light. A table may say how much of each bin is visible from somewhere, without knowing its
// texels.
#include <bit>
#include <cstdint>
#include <vector>

#include "worker/render/light/alias_table.h"
#include "worker/render/math/vec.h"

namespace lightmill {

struct BinnedDensity {
  /// Bins per row and column of an environment at most; 16 make bins of 12 degrees.
  static constexpr int32_t kMostBins = 16;

  int32_t side = 0;    // bins per row and column; 0: there are none
  int32_t block = 0;   // texels per row and column of a bin
  int32_t texels = 0;  // texels per row and column of the image
  // Of the light of a bin, the part in its first rows, and of a row of a bin, the part in its first texels.
  std::vector<float> row_end;     // block per bin
  std::vector<float> column_end;  // per texel
  std::vector<float> in_bin;      // per texel: density within its bin, whose area counts as 1
  std::vector<double> weight;     // per bin: sum of its texels' weights
  // Per table and bin.
  std::vector<float> share;  // probability x number of bins
  std::vector<float> keep;   // alias method
  std::vector<int32_t> alias;

  BinnedDensity() = default;
  /// `weights`: of the texels of a square image, row-major. A texel that has any weight gets at least a
  /// hundred thousandth of its bin's mean. At most `most_bins` bins per row and column. Makes no tables.
  explicit BinnedDensity(const std::vector<double>& weights, int32_t most_bins = kMostBins);

  int32_t count() const { return side * side; }
  bool empty() const { return share.empty(); }
  /// Appends a table that draws bins in proportion to these weights.
  void add_table(const std::vector<double>& weights);
  /// Appends the table that draws bins by their own weights.
  void add_table() { add_table(weight); }
  uint64_t bytes() const;

  /// The bin of the texel in column x, row y.
  template <class F>
  IntOf<F> bin(IntOf<F> x, IntOf<F> y) const {
    const float inv = 1.0f / static_cast<float>(block);
    return to_int((to_float(y) + 0.5f) * inv) * side + to_int((to_float(x) + 0.5f) * inv);
  }
  /// Density of draw() over the unit square of the image.
  template <class F>
  F density(IntOf<F> table, IntOf<F> x, IntOf<F> y) const {
    return gather(share.data(), table * count() + bin<F>(x, y)) * gather(in_bin.data(), y * texels + x);
  }
  /// Draws a texel: its bin by `pick`, its column and row by u and v, which then become the place inside the
  /// texel.
  template <class F>
  void draw(IntOf<F> table, F pick, F* u, F* v, IntOf<F>* x, IntOf<F>* y) const {
    const IntOf<F> chosen = select_alias<F>(keep, alias, count(), table * count(), pick);
    const IntOf<F> row = to_int((to_float(chosen) + 0.5f) * (1.0f / static_cast<float>(side)));
    *y = row * block + find<F>(row_end, chosen * block, v);
    const IntOf<F> column = (chosen - row * side) * block;
    *x = column + find<F>(column_end, *y * texels + column, u);
  }

 private:
  /// Returns the first of the `block` ends from `first` on that lies beyond u. u becomes the place before
  /// that end.
  template <class F>
  IntOf<F> find(const std::vector<float>& ends, IntOf<F> first, F* u) const {
    IntOf<F> at{};
    for (auto step = static_cast<int32_t>(std::bit_floor(static_cast<uint32_t>(block - 1))); step > 0;
         step /= 2) {
      const IntOf<F> next = at + step;
      const MaskOf<F> within = MaskOf<F>(next < block);
      const F end = gather(ends.data(), first + select(within, next, splat_int<F>(1)) - 1);
      at = select(mask_and(within, MaskOf<F>(end <= *u)), next, at);
    }
    const MaskOf<F> later = MaskOf<F>(at > 0);
    const F before = select(later, gather(ends.data(), first + select(later, at - 1, IntOf<F>{})), F{});
    const F width = gather(ends.data(), first + at) - before;
    *u = clamp((*u - before) / select(MaskOf<F>(width > 0.0f), width, splat<F>(1.0f)), 0.0f, 1 - 0x1p-24f);
    return at;
  }
};

}  // namespace lightmill
