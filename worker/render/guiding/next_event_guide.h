#pragma once
// The next-event guide: which light next-event estimation draws, and from where in the sky, by what arrives
// at the point.
//
// Without it the choice goes by power. Then a room's lamp is drawn as often where a wall hides it, and most
// of a sky's directions end on the wall beside the window. A grid lies over the scene. Each cell has a table
// for each choice. Tables are filled before rendering from what was seen there
// (training/next_event_guide_training.h) and then fixed. So every density is a function of the point alone,
// and MIS works as without the guide. A part of each table stays as it was without the guide, so that nothing
// that shines is never drawn.
//
// Error: two strategies may round a point near the border of two cells into different ones. Its weights then
// don't sum to one. place_grid() puts borders where next to no points are.
#include <array>
#include <cstdint>
#include <vector>

#include "common/scene/description.h"
#include "worker/render/light/alias_table.h"
#include "worker/render/math/vec.h"

namespace lightmill {

struct LightTable;

/// Cells of a box. Points outside belong to the nearest one.
struct LightGrid {
  std::array<float, 3> origin{}, per_unit{};  // per_unit: cells per unit of length
  std::array<int32_t, 3> cells{1, 1, 1};

  int32_t count() const { return cells[0] * cells[1] * cells[2]; }
  template <class F>
  IntOf<F> at(const Vec3<F>& p) const {
    const auto along = [&](F x, size_t axis) {
      return to_int(clamp((x - origin[axis]) * per_unit[axis], 0.0f, static_cast<float>(cells[axis]) - 0.5f));
    };
    return (along(p.z, 2) * cells[1] + along(p.y, 1)) * cells[0] + along(p.x, 0);
  }
};

/// A grid over nearly all of `points`, at most `most` + 1 cells along an axis, with borders away from walls.
LightGrid place_grid(const std::vector<Vec3f>& points, int most);

struct NextEventGuide {
  LightGrid grid;
  std::vector<int32_t> table_of;  // per cell: number of its table; empty: there is no guide
  int32_t lights = 0;             // lights to choose from; 0: by power, as without a guide
  // Per table and light.
  std::vector<float> probability, keep;
  std::vector<int32_t> alias;
  double gain = 1;  // mean square of a sample without the guide over that with it, as measured in training

  bool empty() const { return table_of.empty(); }
  bool chooses() const { return lights > 0; }
  template <class F>
  IntOf<F> table_at(const Vec3<F>& p) const {
    return gather(table_of.data(), grid.at<F>(p));
  }
  template <class F>
  IntOf<F> choose(IntOf<F> table, F u) const {
    return select_alias<F>(keep, alias, lights, table * lights, u);
  }
  template <class F>
  F probability_of(IntOf<F> table, IntOf<F> light) const {
    return gather(probability.data(), table * lights + light);
  }
  uint64_t bytes() const {
    return 4 * (table_of.capacity() + probability.capacity() + keep.capacity() + alias.capacity());
  }
};

/// What samples of lights add at the points of a table: mean squares.
struct LightMoments {
  std::vector<double> light;             // per light, drawn for certain; with bins: see sky
  std::vector<std::vector<double>> sky;  // per environment map: per bin, drawn for certain; empty: no bins
  double weight = 1;                     // number of points that it stands for
};

/// Means over the points of mean squares: of the skies with bins, drawn as without the guide, and of all
/// lights drawn by it (of the same skies alone where it does not choose among lights).
struct GuidedSquares {
  double skies_before = 0, after = 0;
};

/// Makes the tables of `lights`' guide and of its environments' bins. `table_of`: per cell, a number in
/// `tables`. `sky_light` names the light of each environment map that has bins. Lights beyond kGuidedLights
/// in number are chosen as without a guide.
inline constexpr int32_t kGuidedLights = 64;
GuidedSquares guide_lights(const LightGrid& grid, const std::vector<int32_t>& table_of,
                           const std::vector<LightMoments>& tables, const std::vector<int32_t>& sky_light,
                           LightTable* lights);

}  // namespace lightmill
