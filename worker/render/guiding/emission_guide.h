#pragma once
// Guided emission sampling: directions of light paths are drawn from tables of cells
// (LightTable::emission_guide).
//
// The cells cover a square of directions. For a lamp with one side it is the square around the unit disk that
// directions project to across the normal. For lamps with two sides and lights at a point it is that of the
// equal-area map of the sphere (math/equal_area.h).
#include "worker/render/light/light_table.h"
#include "worker/render/math/equal_area.h"

namespace lightmill {

/// The cell, of `count` along a side of the square [-1, 1]^2, that a coordinate lies in.
template <class F>
inline IntOf<F> square_cell(F at, int32_t count) {
  const auto n = static_cast<float>(count);
  return to_int(clamp((at + 1.0f) * (0.5f * n), 0.0f, n - 0.5f));
}

/// Where direction w lies on the square [-1, 1]^2 of the whole sphere.
template <class F>
inline void sphere_to_square(const Vec3<F>& w, F* x, F* y) {
  equal_area_sphere_to_square(w, x, y);
  *x = 2.0f * *x - 1.0f;
  *y = 2.0f * *y - 1.0f;
}

/// Density at (x, y) of draws from `cells`, per unit area of the square [-1, 1]^2.
template <class F>
inline F square_density(const BinnedDensity& cells, IntOf<F> table, F x, F y) {
  return 0.25f * cells.density<F>(table, square_cell(x, cells.texels), square_cell(y, cells.texels));
}

/// Draws (x, y) in the square [-1, 1]^2 from `cells`, by the random numbers `pick`, u and v. Returns the
/// density. It is that of the cell that was chosen: at its border the point may round into the next one.
template <class F>
inline F draw_in_square(const BinnedDensity& cells, IntOf<F> table, F pick, F u, F v, F* x, F* y) {
  IntOf<F> column, row;
  cells.draw<F>(table, pick, &u, &v, &column, &row);
  const float inv = 1.0f / static_cast<float>(cells.texels);
  *x = (to_float(column) + u) * (2 * inv) - 1.0f;
  *y = (to_float(row) + v) * (2 * inv) - 1.0f;
  return 0.25f * cells.density<F>(table, column, row);
}

template <class F>
struct GuidedDirection {
  Vec3<F> w;         // unit, away from the light
  F cos_light{};     // |cosine| to the lamp's normal; 1 at a point
  F pdf{};           // per unit solid angle
  MaskOf<F> lost{};  // not a direction of the light: such a path carries nothing
};

/// The emission guides of one light per lane.
template <class F>
struct EmissionGuide {
  MaskOf<F> mask;  // lanes whose lights have a guide

  /// `normal`: of lamps. Not read for lights at a point.
  EmissionGuide(const LightTable& lights, IntOf<F> light, IntOf<F> type, const Vec3<F>& normal, F two_sided)
      : mask(MaskOf<F>(gather(lights.emission_guide_of.data(), light) >= 0)),
        cells_(lights.emission_guide),
        table_(select(mask, gather(lights.emission_guide_of.data(), light), IntOf<F>{})),
        lamp_(MaskOf<F>(type == kTriangleLight)),
        disk_(mask_and(lamp_, mask_not(MaskOf<F>(two_sided > 0.0f)))),
        any_round_(any(mask_and(mask, mask_not(disk_)))),
        frame_(select(mask_and(mask, lamp_), normal, splat3<F>(0, 0, 1))) {}

  /// Density of w per unit solid angle. `cos_light`: |cosine| to a lamp's normal.
  F density(const Vec3<F>& w, F cos_light) const {
    F pdf = square_density<F>(cells_, table_, dot(w, frame_.s), dot(w, frame_.t)) * cos_light;
    if (!any_round_) return pdf;
    F x, y;
    sphere_to_square(w, &x, &y);
    return select(disk_, pdf, square_density<F>(cells_, table_, x, y) * kInvPi);
  }

  GuidedDirection<F> draw(F pick, F u, F v) const {
    GuidedDirection<F> d;
    F x, y;
    const F of_cell = draw_in_square<F>(cells_, table_, pick, u, v, &x, &y);
    const F z2 = 1.0f - x * x - y * y;
    // Corners of cells that are not on the disk.
    d.lost = mask_and(disk_, MaskOf<F>(z2 <= 0.0f));
    d.cos_light = select(d.lost, splat<F>(1.0f), safe_sqrt(z2));
    d.w = select(d.lost, frame_.n, frame_.to_world({x, y, d.cos_light}));
    d.pdf = of_cell * d.cos_light;
    if (!any_round_) return d;
    const Vec3<F> round = equal_area_square_to_sphere(0.5f * x + 0.5f, 0.5f * y + 0.5f);
    d.w = select(disk_, d.w, round);
    d.cos_light = select(disk_, d.cos_light, select(lamp_, abs(dot(round, frame_.n)), splat<F>(1.0f)));
    d.pdf = select(disk_, d.pdf, of_cell * kInvPi);
    return d;
  }

 private:
  const BinnedDensity& cells_;
  IntOf<F> table_;
  MaskOf<F> lamp_, disk_;
  bool any_round_;
  Frame<F> frame_;  // around the normal
};

}  // namespace lightmill
