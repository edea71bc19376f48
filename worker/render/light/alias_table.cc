#include "worker/render/light/alias_table.h"

#include <cstddef>

namespace lightmill {

std::vector<double> build_alias_table(const std::vector<double>& weights, std::vector<float>* keep,
                                      std::vector<int32_t>* alias) {
  const std::size_t n = weights.size();
  double total = 0;
  for (double w : weights) total += w;
  std::vector<double> probability(n);
  for (std::size_t i = 0; i < n; ++i) {
    probability[i] = total > 0 ? weights[i] / total : 1.0 / static_cast<double>(n);
  }
  // Columns of height 1/n, each holding at most two items.
  std::vector<double> q = probability;
  keep->assign(n, 1.0f);
  alias->resize(n);
  std::vector<std::size_t> small, large;
  for (std::size_t i = 0; i < n; ++i) {
    (*alias)[i] = static_cast<int32_t>(i);
    q[i] *= static_cast<double>(n);
    (q[i] < 1 ? small : large).push_back(i);
  }
  while (!small.empty() && !large.empty()) {
    const std::size_t s = small.back(), l = large.back();
    small.pop_back();
    (*keep)[s] = static_cast<float>(q[s]);
    (*alias)[s] = static_cast<int32_t>(l);
    q[l] -= 1 - q[s];
    if (q[l] < 1) {
      large.pop_back();
      small.push_back(l);
    }
  }
  // Rounding may leave a column a hair short: it keeps itself, unless it has no weight at all.
  for (const std::size_t s : small) {
    if (probability[s] == 0 && !large.empty()) {
      (*keep)[s] = 0;
      (*alias)[s] = static_cast<int32_t>(large.back());
    }
  }
  return probability;
}

}  // namespace lightmill
