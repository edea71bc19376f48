#include "worker/render/camera/pixel_filter.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

FilterAxis::FilterAxis(FilterKind kind, double radius, double sigma)
    : kind_(kind), radius_(static_cast<float>(radius)), reach_(static_cast<int>(2 * radius) + 1) {
  if (kind != FilterKind::kGaussian) return;
  // CDF on a fine grid, inverted into kTable equal-probability steps.
  constexpr int kFine = 8192;
  const double floor = std::exp(-radius * radius / (2 * sigma * sigma));
  std::array<double, kFine + 1> cdf{};
  for (size_t i = 0; i < kFine; ++i) {
    const double x = ((static_cast<double>(i) + 0.5) / kFine * 2 - 1) * radius;
    cdf[i + 1] = cdf[i] + std::max(0.0, std::exp(-x * x / (2 * sigma * sigma)) - floor);
  }
  size_t at = 0;
  for (size_t k = 0; k <= kTable; ++k) {
    const double target = cdf[kFine] * static_cast<double>(k) / kTable;
    while (at < kFine && cdf[at + 1] < target) ++at;
    const double step = cdf[at + 1] - cdf[at];
    const double fraction = step > 0 ? (target - cdf[at]) / step : 0;
    inverse_[k] = static_cast<float>(((static_cast<double>(at) + fraction) / kFine * 2 - 1) * radius);
  }
  inverse_[0] = -radius_;
  inverse_[kTable] = radius_;
  for (size_t k = 1; k <= kTable; ++k) {
    // Samples are linear between entries, so the density is constant: 1 / (kTable * step).
    const float step = inverse_[k] - inverse_[k - 1];
    density_before_[k] = step > 0 ? 1.0f / (kTable * step) : 0.0f;
  }
  const auto first_above = [&](int cell) {
    const float edge = (2 * static_cast<float>(cell) / kCells - 1) * radius_;
    return static_cast<int32_t>(std::upper_bound(inverse_.begin() + 1, inverse_.end() - 1, edge) -
                                inverse_.begin());
  };
  for (int cell = 0; cell < kCells; ++cell) {
    // From a cell earlier to a cell later, as the cell of an offset is found by rounding.
    search_from_[static_cast<size_t>(cell)] = first_above(cell - 1);
    steps_ = std::max(steps_, first_above(cell + 2) - first_above(cell - 1));
  }
}

}  // namespace lightmill
