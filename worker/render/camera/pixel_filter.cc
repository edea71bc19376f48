#include "worker/render/camera/pixel_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lightmill {

namespace {

/// Mitchell & Netravali 1988, over [-2, 2].
double mitchell(double x, double b, double c) {
  x = std::fabs(x);
  if (x > 2) return 0;
  const double x2 = x * x, x3 = x2 * x;
  const double inner = (12 - 9 * b - 6 * c) * x3 + (12 * b + 6 * c - 18) * x2 + 6 - 2 * b;
  const double outer = (-b - 6 * c) * x3 + (6 * b + 30 * c) * x2 - (12 * b + 48 * c) * x + 8 * b + 24 * c;
  return (x <= 1 ? inner : outer) / 6;
}

double sinc(double x) { return std::fabs(x) < 1e-5 ? 1 : std::sin(M_PI * x) / (M_PI * x); }

/// Up to a factor.
double tabulated(const FilterDescription& filter, double radius, double x) {
  if (filter.kind == FilterKind::kMitchell) return mitchell(2 * x / radius, filter.b, filter.c);
  if (filter.kind == FilterKind::kSinc) return sinc(x) * sinc(x / filter.tau);
  const double s2 = 2 * filter.sigma * filter.sigma;
  return std::max(0.0, std::exp(-x * x / s2) - std::exp(-radius * radius / s2));
}

}  // namespace

FilterAxis::FilterAxis(const FilterDescription& filter, double radius)
    : kind_(filter.kind), radius_(static_cast<float>(radius)) {
  weight_.fill(1);
  if (kind_ == FilterKind::kBox || kind_ == FilterKind::kTriangle) return;
  // CDF of the absolute value on a fine grid, inverted into kTable equal-probability steps; and the integral.
  constexpr int kFine = 8192;
  std::array<double, kFine + 1> cdf{}, integral{};
  for (size_t i = 0; i < kFine; ++i) {
    const double x = ((static_cast<double>(i) + 0.5) / kFine * 2 - 1) * radius;
    const double f = tabulated(filter, radius, x);
    cdf[i + 1] = cdf[i] + std::fabs(f);
    integral[i + 1] = integral[i] + f;
  }
  size_t at = 0;
  double before = 0;
  for (size_t k = 0; k <= kTable; ++k) {
    const double target = cdf[kFine] * static_cast<double>(k) / kTable;
    while (at < kFine && cdf[at + 1] < target) ++at;
    const double step = at < kFine ? cdf[at + 1] - cdf[at] : 0;
    const double fraction = step > 0 ? (target - cdf[at]) / step : 0;
    inverse_[k] = static_cast<float>(((static_cast<double>(at) + fraction) / kFine * 2 - 1) * radius);
    const double here = k == 0        ? 0
                        : k == kTable ? integral[kFine]
                                      : integral[at] + fraction * (integral[at + 1] - integral[at]);
    if (k > 0 && is_signed()) weight_[k - 1] = static_cast<float>(kTable * (here - before) / integral[kFine]);
    before = here;
  }
  inverse_[0] = -radius_;
  inverse_[kTable] = radius_;
  for (size_t k = 1; k <= kTable; ++k) {
    // Samples are linear between entries, so the density is constant: 1 / (kTable * step).
    const float step = inverse_[k] - inverse_[k - 1];
    const float density = step > 0 ? weight_[k - 1] / (kTable * step) : 0.0f;
    entries_[k] = {inverse_[k], density, density};
    entries_[k - 1][2] = density;
  }
  // A search does not leave the filter.
  entries_[kTable + 1] = {std::numeric_limits<float>::infinity(), entries_[kTable][1], 0};
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

PixelFilter::PixelFilter(const FilterDescription& d) : x(d, d.xradius), y(d, d.yradius) {
  if (is_one_pixel()) return;
  // Means over positions in a pixel: of the squares of what pixels receive, the sum of |f|, and how many
  // receive something. Filters narrower than a pixel are 0 but around its centre.
  constexpr int kPositions = 8;
  const float wide = std::min(2 * x.radius(), 1.0f), high = std::min(2 * y.radius(), 1.0f);
  const double part = double{wide} * double{high} / (kPositions * kPositions);
  double squares = 0, all = 0, pixels = 0;
  for (int i = 0; i < kPositions * kPositions; ++i) {
    const auto at = [](int k, float width) {
      return 0.5f + width * ((static_cast<float>(k) + 0.5f) / kPositions - 0.5f);
    };
    FilterReach<float>(*this, at(i % kPositions, wide), at(i / kPositions, high))
        .each(0, [&](int, int, float f) {
          const double size = std::fabs(double{f});
          squares += part * size * std::max(size, double{kSmallWeight});
          all += part * size;
          pixels += part * std::min(size / double{kSmallWeight}, 1.0);
        });
  }
  splat_noise = static_cast<float>(squares / (all * all));
  splat_pixels = static_cast<float>(pixels);
}

}  // namespace lightmill
