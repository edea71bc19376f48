#pragma once
// Walker's alias method (Vose 1991): selects in proportion to weights in O(1), from one uniform number.
#include <cstdint>
#include <vector>

#include "worker/render/math/lanes.h"

namespace lightmill {

/// Fills `keep` and `alias` for `weights`. Their sum may be anything; if all are zero, selection is uniform.
/// Column i keeps i with probability keep[i], else gives alias[i]. Returns the probabilities.
std::vector<double> build_alias_table(const std::vector<double>& weights, std::vector<float>* keep,
                                      std::vector<int32_t>* alias);

/// Selects a number below `count` by the uniform u, from the columns from `first` on. `rest`, unless null,
/// becomes uniform in [0, 1) given the number, and as well stratified as `u` is.
template <class F>
inline IntOf<F> select_alias(const std::vector<float>& keep, const std::vector<int32_t>& alias, int32_t count,
                             IntOf<F> first, F u, F* rest = nullptr) {
  if (rest) *rest = u;
  if (count == 1) return IntOf<F>{};
  const F scaled = u * static_cast<float>(count);
  const IntOf<F> column0 = to_int(scaled);
  const IntOf<F> last = splat_int<F>(count - 1);
  const IntOf<F> column = select(MaskOf<F>(column0 > last), last, column0);
  const F fraction = scaled - to_float(column);
  const F kept = gather(keep.data(), first + column);
  const MaskOf<F> own = MaskOf<F>(fraction < kept);
  if (rest) {
    const F part =
        select(own, fraction, fraction - kept) / max(select(own, kept, 1.0f - kept), splat<F>(0x1p-24f));
    *rest = min(part, splat<F>(1 - 0x1p-24f));
  }
  return select(own, column, gather(alias.data(), first + column));
}

/// The same from all columns: an index into `keep`.
template <class F>
inline IntOf<F> select_alias(const std::vector<float>& keep, const std::vector<int32_t>& alias, F u,
                             F* rest = nullptr) {
  return select_alias<F>(keep, alias, static_cast<int32_t>(keep.size()), IntOf<F>{}, u, rest);
}

}  // namespace lightmill
