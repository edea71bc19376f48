#pragma once
// Walker's alias method (Vose 1991): O(1) selection in proportion to weights from one uniform.
#include <cstdint>
#include <vector>

namespace lightmill {

/// Fills `keep` and `alias` for `weights` (their sum may be anything; all zero selects uniformly). Column i
/// keeps i with probability keep[i], else gives alias[i]. Returns the probabilities.
std::vector<double> build_alias_table(const std::vector<double>& weights, std::vector<float>* keep,
                                      std::vector<int32_t>* alias);

}  // namespace lightmill
