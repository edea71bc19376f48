#include "worker/render/guiding/binned_density.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

/// A dim texel of a bin that holds a sun is still found.
constexpr double kLeastOfMean = 1e-5;

/// Writes to `ends` the ends of parts that are proportional to `weights`, or of equal parts if all are 0.
void write_ends(const std::vector<double>& weights, float* ends) {
  double total = 0, sum = 0;
  size_t last = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    total += weights[i];
    if (weights[i] > 0) last = i;
  }
  for (size_t i = 0; i < weights.size(); ++i) {
    sum += total > 0 ? weights[i] / total : 1.0 / static_cast<double>(weights.size());
    ends[i] = total > 0 && i >= last ? 1.0f : static_cast<float>(std::min(sum, 1.0));
  }
  ends[weights.size() - 1] = 1;
}

float width_at(const float* ends, size_t i) { return ends[i] - (i > 0 ? ends[i - 1] : 0.0f); }

/// The largest number of bins a side that are whole texels.
int32_t bins_of(int32_t texels, int32_t most) {
  int32_t n = std::min(texels, most);
  while (texels % n != 0) --n;
  return n;
}

}  // namespace

BinnedDensity::BinnedDensity(const std::vector<double>& weights, int32_t most_bins) {
  texels = static_cast<int32_t>(std::lround(std::sqrt(static_cast<double>(weights.size()))));
  side = bins_of(texels, most_bins);
  block = texels / side;
  const auto n = static_cast<size_t>(block), width = static_cast<size_t>(texels);
  row_end.resize(n * static_cast<size_t>(count()));
  column_end.resize(weights.size());
  in_bin.resize(weights.size());
  for (size_t bin = 0; bin < static_cast<size_t>(count()); ++bin) {
    const size_t first = bin / static_cast<size_t>(side) * n * width + bin % static_cast<size_t>(side) * n;
    double total = 0;
    for (size_t r = 0; r < n; ++r) {
      for (size_t c = 0; c < n; ++c) total += weights[first + r * width + c];
    }
    weight.push_back(total);
    const double least = total / static_cast<double>(n * n) * kLeastOfMean;
    std::vector<double> rows(n), columns(n);
    for (size_t r = 0; r < n; ++r) {
      for (size_t c = 0; c < n; ++c) {
        const double w = weights[first + r * width + c];
        rows[r] += columns[c] = w > 0 ? std::max(w, least) : 0;
      }
      write_ends(columns, &column_end[first + r * width]);
    }
    float* const row = &row_end[bin * n];
    write_ends(rows, row);
    // Of what the floats say, as draw() uses them.
    for (size_t r = 0; r < n; ++r) {
      for (size_t c = 0; c < n; ++c) {
        const size_t texel = first + r * width + c;
        in_bin[texel] =
            static_cast<float>(double{width_at(row, r)} * width_at(&column_end[first + r * width], c) *
                               static_cast<double>(n * n));
      }
    }
  }
}

void BinnedDensity::add_table(const std::vector<double>& weights) {
  std::vector<float> own_keep;
  std::vector<int32_t> own_alias;
  for (const double p : build_alias_table(weights, &own_keep, &own_alias))
    share.push_back(static_cast<float>(p * static_cast<double>(weights.size())));
  keep.insert(keep.end(), own_keep.begin(), own_keep.end());
  alias.insert(alias.end(), own_alias.begin(), own_alias.end());
}

uint64_t BinnedDensity::bytes() const {
  return sizeof(float) * (row_end.capacity() + column_end.capacity() + in_bin.capacity() + share.capacity() +
                          keep.capacity() + alias.capacity());
}

}  // namespace lightmill
