#pragma once
// Pixel reconstruction filters, importance-sampled in both directions.
//
// Camera samples: a pixel's sample position is drawn with density f(p - centre), so its weight is 1 and it
// touches its own pixel only. Splats: a light path that arrives at raster position p contributes f(p - c_j)
// to every pixel j in reach (FilterReach). Both estimate the same integral. Filters are separable and
// normalised to unit integral; gaussian as pbrt's: exp(-x^2/2s^2) minus its value at the radius. Where a
// filter is negative its absolute value is sampled, and both weights carry the sign.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "common/job/packet_grid.h"
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
  /// Whether raster coordinates touch the pixel that they are in alone.
  bool is_one_pixel() const { return kind_ == FilterKind::kBox && radius_ == 0.5f; }
  /// First and last pixel in reach of `p`, as whole numbers.
  template <class F>
  F first_pixel(F p) const {
    return -floor(-(p - radius_ - 0.5f));
  }
  template <class F>
  F last_pixel(F p) const {
    return floor(p + radius_ - 0.5f);
  }

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
  FilterKind kind_;
  float radius_;
  int steps_ = 1;  // of a search, at most
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

/// Filters reach less far than this.
inline constexpr int kMostRadius = 64;

struct PixelFilter {
  FilterAxis x, y;
  /// Variance of a splat, over that of one which falls to a single pixel drawn by |f|, on average over raster
  /// positions; the latter is that of a camera sample of its pixel. 1 of a box of one pixel, 0.35 of pbrt's
  /// default gaussian.
  float splat_noise = 1;
  float splat_pixels = 1;  // that receive something of a splat, on average
  explicit PixelFilter(const FilterDescription& d);
  bool is_signed() const { return x.is_signed(); }
  bool is_one_pixel() const { return x.is_one_pixel() && y.is_one_pixel(); }

  /// Small weights of a splat go to few pixels in their turn, as a splat is hardly noisier by that: whether
  /// this one is kept, and its weight then, by systematic sampling, `u` being uniform for the first.
  bool is_kept(float* weight, float* u) const {
    const float size = std::fabs(*weight);
    if (size >= kSmallWeight) return true;
    *u += size / kSmallWeight;
    if (*u < 1) return false;
    *u -= 1;
    *weight = std::copysign(kSmallWeight, *weight);
    return true;
  }

 private:
  static constexpr float kSmallWeight = 1.0f / 8;
};

/// The pixels in reach of raster positions, if in `bounds`, and the filter there.
template <class F>
class FilterReach {
 public:
  FilterReach(const PixelFilter& filter, F px, F py, const PixelRect& bounds = kEverywhere)
      : row_(filter.x, px, bounds.x0, bounds.x1), column_(filter.y, py, bounds.y0, bounds.y1) {}
  /// Calls form(x, y, f) where f is not 0, for the position in lane `l`.
  template <class Form>
  void each(int l, Form&& form) const {
    const int x = row_.first_of(l), y = column_.first_of(l);
    for (int j = 0; j < column_.count; ++j) {
      const float fy = column_.of(j, l);
      for (int i = 0; i < row_.count; ++i) {
        const float f = fy * row_.of(i, l);
        if (f != 0) form(x + i, y + j, f);
      }
    }
  }

 private:
  static constexpr PixelRect kEverywhere{-(1 << 24), -(1 << 24), 1 << 24, 1 << 24};
  struct Axis {
    F first, density[2 * kMostRadius + 1];  // of the first `count` pixels
    int count = 0;
    Axis(const FilterAxis& axis, F p, int begin, int end) {
      first = max(axis.first_pixel(p), splat<F>(static_cast<float>(begin)));
      const F last = min(axis.last_pixel(p), splat<F>(static_cast<float>(end - 1)));
      for (F pixel = first; any(MaskOf<F>(pixel <= last)); pixel = pixel + 1.0f)
        density[count++] = select(MaskOf<F>(pixel <= last), axis.density(p - (pixel + 0.5f)), F{});
    }
    // In memory, as lanes differ from call to call.
    float of(int i, int l) const { return reinterpret_cast<const float*>(density + i)[l]; }
    int first_of(int l) const { return static_cast<int>(reinterpret_cast<const float*>(&first)[l]); }
  };
  Axis row_, column_;
};

}  // namespace lightmill
