#include "worker/render/camera/pixel_filter.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

FilterAxis::FilterAxis(FilterKind kind, double radius, double sigma)
    : kind_(kind), radius_(static_cast<float>(radius)) {
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
  for (size_t cell = 0; cell < kTable; ++cell) {
    // From a cell earlier, as the cell of an offset is found by rounding.
    const float edge = (2 * (static_cast<float>(cell) - 1) / kTable - 1) * radius_;
    const auto above = std::upper_bound(inverse_.begin() + 1, inverse_.end() - 1, edge);
    search_from_[cell] = static_cast<uint16_t>(above - inverse_.begin());
  }
}

float FilterAxis::density(float offset) const {
  const float a = std::fabs(offset);
  if (a > radius_) return 0;
  switch (kind_) {
    case FilterKind::kBox:
      return 0.5f / radius_;
    case FilterKind::kTriangle:
      return (radius_ - a) / (radius_ * radius_);
    case FilterKind::kGaussian: {
      const float cell = (offset / radius_ + 1) * (kTable / 2);
      size_t k = search_from_[static_cast<size_t>(std::clamp(cell, 0.0f, kTable - 1.0f))];
      while (k < kTable && inverse_[k] <= offset) ++k;
      return density_before_[k];
    }
  }
  return 0;
}

int FilterAxis::choose_pixel(float p, float u, float* weight) const {
  if (kind_ == FilterKind::kBox && radius_ == 0.5f) {
    *weight = 1;
    return static_cast<int>(std::floor(p));
  }
  const int first = static_cast<int>(std::ceil(p - radius_ - 0.5f)),
            last = static_cast<int>(std::floor(p + radius_ - 0.5f));
  float known[kMostCached];
  float total = 0;
  for (int j = first; j <= last; ++j) {
    const float d = density(p - (static_cast<float>(j) + 0.5f));
    if (j - first < kMostCached) known[j - first] = d;
    total += d;
  }
  *weight = total;
  float target = u * total;
  int chosen = first;
  for (int j = first; j <= last; ++j) {
    const float d = j - first < kMostCached ? known[j - first] : density(p - (static_cast<float>(j) + 0.5f));
    if (d > 0) chosen = j;
    if (d > 0 && target < d) break;
    target -= d;
  }
  return chosen;
}

}  // namespace lightmill
