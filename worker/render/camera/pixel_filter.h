#pragma once
// Pixel reconstruction filters, importance-sampled in both directions.
//
// Camera samples: a pixel's sample position is drawn with density f(p - centre), so its weight is 1 and it
// touches its own pixel only. Splats: a light path that arrives at raster position p contributes f(p - c_j)
// to every pixel j in reach; one of them is drawn with probability proportional to that, and the sum is the
// weight. Both estimate the same integral. Filters are separable and normalised to unit integral; gaussian
// as pbrt's: exp(-x^2/2s^2) minus its value at the radius. Where a filter is negative its absolute value is
// sampled, and both weights carry the sign.
#include <array>
#include <cstdint>

#include "common/scene/description.h"
#include "worker/render/math/vec.h"

namespace lightmill {

/// One axis of the filter, with a tabulated inverse CDF.
class FilterAxis {
 public:
  FilterAxis(const FilterDescription& filter, double radius);
  float radius() const { return radius_; }
  bool is_signed() const { return kind_ == FilterKind::kMitchell || kind_ == FilterKind::kSinc; }
  /// Offset from the pixel's centre for a uniform u.
  template <class F>
  F sample(F u) const {
    if (kind_ == FilterKind::kBox) return (2.0f * u - 1.0f) * radius_;
    if (kind_ == FilterKind::kTriangle) {
      const F t = 2.0f * u - 1.0f;  // symmetric about 0: 1 - sqrt(1 - |t|), with the sign of t
      return copysign(1.0f - safe_sqrt(1.0f - abs(t)), t) * radius_;
    }
    const F x = u * static_cast<float>(kTable);
    const IntOf<F> i = cell_of(u);
    const F a = gather(inverse_.data(), i), b = gather(inverse_.data() + 1, i);
    return a + (b - a) * (x - to_float(i));
  }
  /// What a sample by `u` stands for; its mean over u is 1. Of signed filters; 1 of others.
  template <class F>
  F weight(F u) const {
    return gather(weight_.data(), cell_of(u));
  }
  /// The filter at `offset`: the density of sample(), times the weight, which camera samples really follow.
  template <class F>
  F density(F offset) const;
  /// Draws the pixel for raster coordinate `p` with `u`; returns its index and sets the weight
  /// sum_j f(p - c_j) (0 if no pixel is in reach).
  template <class F>
  IntOf<F> choose_pixel(F p, F u, F* weight) const;

 private:
  static constexpr int kTable = 256;
  template <class F>
  static IntOf<F> cell_of(F u) {
    const IntOf<F> i = to_int(u * static_cast<float>(kTable)), last = splat_int<F>(kTable - 1);
    return select(MaskOf<F>(i > last), last, i);
  }
  bool is_tabulated() const { return kind_ != FilterKind::kBox && kind_ != FilterKind::kTriangle; }
  // For cells of equal width over [-radius, radius] a table entry at or before the first above the cell,
  // where a search begins. Cells are much narrower than most entries are apart: it has few steps.
  static constexpr int kCells = 8 * kTable;
  static constexpr int kMostCached = 8;  // pixels in reach whose densities are kept
  FilterKind kind_;
  float radius_;
  int reach_ = 1, steps_ = 1;  // pixels that one position may touch, at most; steps of a search, at most
  // But of box and triangle: piecewise-linear inverse CDF.
  std::array<float, kTable + 1> inverse_{};
  std::array<std::array<float, 3>, kTable + 2> entries_{};  // each entry, and the filter before and after it
  std::array<int32_t, kCells> search_from_{};
  std::array<float, kTable> weight_{};  // of the cells of u
};

template <class F>
F FilterAxis::density(F offset) const {
  const F a = abs(offset);
  F d = splat<F>(0.5f / radius_);
  if (kind_ == FilterKind::kTriangle) d = (radius_ - a) / splat<F>(radius_ * radius_);
  if (is_tabulated()) {
    const F cell = clamp((offset / splat<F>(radius_) + 1.0f) * (kCells / 2.0f), 0.0f, kCells - 1.0f);
    IntOf<F> k = gather(search_from_.data(), to_int(cell));
    for (int i = 0; i < steps_; ++i) {
      F step[3];
      load_triples(entries_.front().data(), k * 3, step);
      const MaskOf<F> beyond = MaskOf<F>(step[0] <= offset);
      d = select(beyond, step[2], step[1]);
      k = select(beyond, k + 1, k);
    }
  }
  return select(MaskOf<F>(a <= radius_), d, F{});
}

template <class F>
IntOf<F> FilterAxis::choose_pixel(F p, F u, F* weight) const {
  if (kind_ == FilterKind::kBox && radius_ == 0.5f) {
    *weight = splat<F>(1.0f);
    return to_int(floor(p));
  }
  const F first = -floor(-(p - radius_ - 0.5f)), last = floor(p + radius_ - 0.5f);
  const auto density_of = [&](F pixel) {
    return select(MaskOf<F>(pixel <= last), density(p - (pixel + 0.5f)), F{});
  };
  F known[kMostCached], total{}, pixel = first;
  int reached = 0;  // reach_ only where a position has pixels at both ends of the filter
  for (; reached < reach_ && any(MaskOf<F>(pixel <= last)); ++reached, pixel = pixel + 1.0f) {
    const F d = density_of(pixel);
    if (reached < kMostCached) known[reached] = d;
    total = total + abs(d);
  }
  F target = u * total, chosen = first, sign = splat<F>(1.0f);
  MaskOf<F> done = splat_mask<F>(false);
  pixel = first;
  for (int i = 0; i < reached; ++i, pixel = pixel + 1.0f) {
    const F value = i < kMostCached ? known[i] : density_of(pixel), d = abs(value);
    const MaskOf<F> can = mask_and(MaskOf<F>(d > 0.0f), mask_not(done));
    chosen = select(can, pixel, chosen);
    sign = select(can, value, sign);
    done = mask_or(done, mask_and(can, MaskOf<F>(target < d)));
    target = target - d;
  }
  *weight = copysign(total, sign);
  return to_int(chosen);
}

struct PixelFilter {
  FilterAxis x, y;
  bool is_signed() const { return x.is_signed(); }
  explicit PixelFilter(const FilterDescription& d) : x(d, d.xradius), y(d, d.yradius) {}
};

}  // namespace lightmill
