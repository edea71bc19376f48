#pragma once
// Tables of measured BRDFs as kernels read them: bilinear values, and densities with the warps that belong to
// them, each interpolated between the directions that the surface was measured from (Dupuy & Jakob 2018).
#include "worker/render/math/lanes.h"

namespace lightmill {

/// Of the head of a measured BRDF in RenderScene::bsdf_tables: integers, as the bits of floats. Places (At)
/// count floats from the tables' beginning. Heads are at multiples of kMeasuredUnit floats.
enum MeasuredSlot {
  kMeasuredPhiCount,
  kMeasuredThetaCount,
  kMeasuredIsotropic,
  kMeasuredPhiAt,
  kMeasuredThetaAt,
  kMeasuredNdf,  // width, height, place of the values
  kMeasuredSigma = kMeasuredNdf + 3,
  kMeasuredVisible = kMeasuredSigma + 3,  // likewise, and places of the conditional and the marginal sums
  kMeasuredLuminance = kMeasuredVisible + 5,
  kMeasuredRgbAt = kMeasuredLuminance + 5,
  kMeasuredHead
};
inline constexpr int kMeasuredUnit = 64;
static_assert(kMeasuredHead <= kMeasuredUnit);

/// Greatest i in [0, count - 2] for which at_most(i) holds, or 0; once it fails, it fails for all that
/// follow.
template <class F, class AtMost>
inline IntOf<F> last_node(IntOf<F> count, const AtMost& at_most) {
  IntOf<F> low{}, high = count - 2;
  for (;;) {
    const MaskOf<F> open = MaskOf<F>(low < high);
    if (!any(open)) return low;
    const IntOf<F> middle = (low + high + 1) >> 1;
    const MaskOf<F> holds = at_most(select(open, middle, low));
    low = select(mask_and(open, holds), middle, low);
    high = select(mask_and(open, mask_not(holds)), middle - 1, high);
  }
}

/// The slices around a direction of view, with their weights; tables of one azimuth have two.
template <class F>
struct MeasuredViews {
  int count = 2;
  IntOf<F> slice[4];
  F weight[4];

  /// `phi` and `theta` in radians. Beyond the ends the last node counts alone.
  MeasuredViews(const float* tables, IntOf<F> head, F phi, F theta) {
    const auto integer = [&](int slot) { return as_int(float_bits(gather(tables + slot, head))); };
    const IntOf<F> phis = integer(kMeasuredPhiCount), thetas = integer(kMeasuredThetaCount);
    const Axis along(tables, integer(kMeasuredThetaAt), thetas, theta);
    slice[0] = along.low;
    slice[1] = along.high;
    weight[0] = 1.0f - along.t;
    weight[1] = along.t;
    if (!any(MaskOf<F>(phis > 1))) return;
    count = 4;
    const Axis around(tables, integer(kMeasuredPhiAt), phis, phi);
    for (int k = 0; k < 2; ++k) {
      slice[k + 2] = slice[k] + around.high * thetas;
      slice[k] = slice[k] + around.low * thetas;
      weight[k + 2] = weight[k] * around.t;
      weight[k] = weight[k] * (1.0f - around.t);
    }
  }
  /// What `base` + slice * stride points to, blended.
  F blend(const float* tables, IntOf<F> base, IntOf<F> stride) const {
    F sum = weight[0] * gather(tables, base + slice[0] * stride);
    for (int k = 1; k < count; ++k) sum = sum + weight[k] * gather(tables, base + slice[k] * stride);
    return sum;
  }

 private:
  struct Axis {
    IntOf<F> low, high;
    F t;
    Axis(const float* tables, IntOf<F> at, IntOf<F> count, F x) {
      low = last_node<F>(count, [&](IntOf<F> i) { return MaskOf<F>(gather(tables, at + i) <= x); });
      high = select(MaskOf<F>(low + 1 < count), low + 1, low);
      const F a = gather(tables, at + low), b = gather(tables, at + high);
      const MaskOf<F> apart = MaskOf<F>(b > a);
      t = select(apart, clamp((x - a) / select(apart, b - a, splat<F>(1.0f)), 0.0f, 1.0f), F{});
    }
  };
};

/// A cell of a grid over the unit square and the place within it.
template <class F>
struct MeasuredCell {
  IntOf<F> width, x_node, y_node;
  F s, t;

  MeasuredCell(IntOf<F> w, IntOf<F> h, F x, F y) : width(w) {
    const F at_x = clamp(x, 0.0f, 1.0f) * to_float(w - 1), at_y = clamp(y, 0.0f, 1.0f) * to_float(h - 1);
    const auto low = [](F at, IntOf<F> count) {
      const IntOf<F> i = to_int(at);
      return select(MaskOf<F>(i < count - 2), i, count - 2);
    };
    x_node = low(at_x, w);
    y_node = low(at_y, h);
    s = at_x - to_float(x_node);
    t = at_y - to_float(y_node);
  }
  /// Index of the node at (x_node + dx, y_node + dy).
  IntOf<F> node(int dx, int dy) const { return (y_node + dy) * width + (x_node + dx); }
  /// Bilinear in value(node).
  template <class Value>
  F interpolate(const Value& value) const {
    const F below = value(node(0, 0)) * (1.0f - s) + value(node(1, 0)) * s;
    const F above = value(node(0, 1)) * (1.0f - s) + value(node(1, 1)) * s;
    return below * (1.0f - t) + above * t;
  }
};

/// A bilinear density over the unit square, by views, and the warp that makes it of uniform points: rows by
/// their sums (marginal), then nodes within the row (conditional).
template <class F>
class MeasuredWarp {
 public:
  struct Point {
    F x, y;
    F density;  // at the warped point, per unit area
  };

  MeasuredWarp(const float* tables, IntOf<F> head, int slot, const MeasuredViews<F>& views)
      : tables_(tables), views_(views) {
    const auto integer = [&](int i) { return as_int(float_bits(gather(tables + slot + i, head))); };
    width_ = integer(0);
    height_ = integer(1);
    values_ = integer(2);
    conditional_ = integer(3);
    marginal_ = integer(4);
    nodes_ = width_ * height_;
  }
  IntOf<F> width() const { return width_; }
  IntOf<F> height() const { return height_; }

  F density(F x, F y) const {
    return MeasuredCell<F>(width_, height_, x, y).interpolate([&](IntOf<F> i) { return value(i); });
  }
  Point sample(F u, F v) const {
    const IntOf<F> row = last_node<F>(height_, [&](IntOf<F> i) { return MaskOf<F>(marginal(i) <= v); });
    const F r0 = row_sum(row), r1 = row_sum(row + 1);
    const F t = inverse_of_line(r0, r1, (v - marginal(row)) * to_float(height_ - 1));
    const F target = u * (r0 * (1.0f - t) + r1 * t);
    const auto sum_to = [&](IntOf<F> i) {
      return conditional(row * width_ + i) * (1.0f - t) + conditional((row + 1) * width_ + i) * t;
    };
    const IntOf<F> column = last_node<F>(width_, [&](IntOf<F> i) { return MaskOf<F>(sum_to(i) <= target); });
    const IntOf<F> corner = row * width_ + column;
    const F d0 = value(corner) * (1.0f - t) + value(corner + width_) * t;
    const F d1 = value(corner + 1) * (1.0f - t) + value(corner + width_ + 1) * t;
    const F s = inverse_of_line(d0, d1, (target - sum_to(column)) * to_float(width_ - 1));
    return {(to_float(column) + s) / to_float(width_ - 1), (to_float(row) + t) / to_float(height_ - 1),
            d0 * (1.0f - s) + d1 * s};
  }
  /// The uniform point that sample() takes to (x, y), with the density there.
  Point invert(F x, F y) const {
    const MeasuredCell<F> c(width_, height_, x, y);
    const F r0 = row_sum(c.y_node), r1 = row_sum(c.y_node + 1);
    const IntOf<F> corner = c.node(0, 0), above = c.node(0, 1);
    const F d0 = value(corner) * (1.0f - c.t) + value(above) * c.t;
    const F d1 = value(corner + 1) * (1.0f - c.t) + value(above + 1) * c.t;
    const F before = conditional(corner) * (1.0f - c.t) + conditional(above) * c.t;
    const F total = r0 * (1.0f - c.t) + r1 * c.t;
    const F within = before + line_sum(d0, d1, c.s) / to_float(width_ - 1);
    const MaskOf<F> some = MaskOf<F>(total > 0.0f);
    const F u = select(some, within / select(some, total, splat<F>(1.0f)), F{});
    const F v = marginal(c.y_node) + line_sum(r0, r1, c.t) / to_float(height_ - 1);
    return {clamp(u, 0.0f, 1.0f), clamp(v, 0.0f, 1.0f), d0 * (1.0f - c.s) + d1 * c.s};
  }

 private:
  F value(IntOf<F> i) const { return views_.blend(tables_, values_ + i, nodes_); }
  F conditional(IntOf<F> i) const { return views_.blend(tables_, conditional_ + i, nodes_); }
  F marginal(IntOf<F> i) const { return views_.blend(tables_, marginal_ + i, height_); }
  F row_sum(IntOf<F> row) const { return conditional(row * width_ + width_ - 1); }
  /// Integral from 0 to t of the line from a (at 0) to b (at 1).
  static F line_sum(F a, F b, F t) { return t * (a + 0.5f * t * (b - a)); }
  /// The t in [0, 1] at which it is `sum`.
  static F inverse_of_line(F a, F b, F sum) {
    const F root = a + safe_sqrt(a * a + 2.0f * sum * (b - a));
    const MaskOf<F> some = MaskOf<F>(root > 0.0f);
    return select(some, clamp(2.0f * sum / select(some, root, splat<F>(1.0f)), 0.0f, 1.0f), F{});
  }

  const float* tables_;
  const MeasuredViews<F>& views_;
  IntOf<F> width_, height_, values_, conditional_, marginal_, nodes_;
};

}  // namespace lightmill
