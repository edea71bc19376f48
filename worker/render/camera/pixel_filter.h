#pragma once
// Pixel reconstruction filters, importance-sampled in both directions.
//
// Camera samples: a pixel's sample position is drawn with density f(p - centre), so its weight is 1 and it
// touches its own pixel only. Splats: a light path that arrives at raster position p contributes f(p - c_j)
// to every pixel j in reach; one of them is drawn with probability proportional to that, and the sum is the
// weight. Both estimate the same integral. Filters are separable and normalised to unit integral; gaussian
// as pbrt's: exp(-x^2/2s^2) minus its value at the radius.
#include <array>
#include <cstdint>

#include "common/scene/description.h"
#include "worker/render/math/vec.h"

namespace lightmill {

/// One axis of the filter, with a tabulated inverse CDF.
class FilterAxis {
 public:
  FilterAxis(FilterKind kind, double radius, double sigma);
  float radius() const { return radius_; }
  /// Offset from the pixel's centre for a uniform u.
  template <class F>
  F sample(F u) const {
    if (kind_ == FilterKind::kBox) return (2.0f * u - 1.0f) * radius_;
    if (kind_ == FilterKind::kTriangle) {
      const F t = 2.0f * u - 1.0f;  // symmetric about 0: 1 - sqrt(1 - |t|), with the sign of t
      return copysign(1.0f - safe_sqrt(1.0f - abs(t)), t) * radius_;
    }
    const F x = u * static_cast<float>(kTable);
    const IntOf<F> i0 = to_int(x);
    const IntOf<F> last = splat_int<F>(kTable - 1);
    const IntOf<F> i = select(MaskOf<F>(i0 > last), last, i0);
    const F a = gather(inverse_.data(), i), b = gather(inverse_.data() + 1, i);
    return a + (b - a) * (x - to_float(i));
  }
  /// Density of sample() at `offset`: what the camera samples really follow.
  float density(float offset) const;
  /// Draws the pixel for raster coordinate `p` with `u`; returns its index and sets the weight
  /// sum_j f(p - c_j) (0 if no pixel is in reach).
  int choose_pixel(float p, float u, float* weight) const;

 private:
  static constexpr int kTable = 256;
  FilterKind kind_;
  float radius_;
  static constexpr int kMostCached = 8;  // pixels in reach whose densities are kept
  // Gaussian: piecewise-linear inverse CDF; the density between its entries; and for cells of equal width
  // over
  // [-radius, radius] an entry at or before the first above the cell, where a search may begin.
  std::array<float, kTable + 1> inverse_{};
  std::array<float, kTable + 1> density_before_{};
  std::array<uint16_t, kTable> search_from_{};
};

struct PixelFilter {
  FilterAxis x, y;
  explicit PixelFilter(const FilterDescription& d)
      : x(d.kind, d.xradius, d.sigma), y(d.kind, d.yradius, d.sigma) {}
};

}  // namespace lightmill
