#pragma once
// Adds layers of partials to those of films, exactly.
#include <vector>

#include "common/film/crop_walk.h"
#include "common/film/exact_sum.h"
#include "common/film/splats/splat_sum.h"
#include "common/job/packet_grid.h"

namespace lightmill {

inline void add_sum(const ExactRgb& sum, bool subtract, ExactRgb* to) {
  for (int c = 0; c < 3; ++c) to->c[c] += subtract ? Units{0} - sum.c[c] : sum.c[c];
}

/// Adds the sums `from` of rectangle `r` to a layer of the crop window; takes them away if `subtract`. No
/// memory is used for an empty `from`.
inline void add_rectangle(const FilmGrid& grid, const PixelRect& r, const std::vector<ExactRgb>& from,
                          bool subtract, std::vector<ExactRgb>* to) {
  if (from.empty()) return;
  if (to->empty()) to->resize(static_cast<size_t>(grid.crop.area()));
  const ExactRgb* source = from.data();
  for (int y = r.y0; y < r.y1; ++y) {
    const int64_t first = int64_t{y - grid.crop.y0} * grid.crop.width() + r.x0 - grid.crop.x0;
    ExactRgb* target = &(*to)[static_cast<size_t>(first)];
    for (int x = r.x0; x < r.x1; ++x) add_sum(*source++, subtract, target++);
  }
}

/// Likewise of splats, in film order, all of them within the crop window.
inline void add_splats(const FilmGrid& grid, const std::vector<SplatSum>& splats, bool subtract,
                       std::vector<ExactRgb>* to) {
  if (!splats.empty() && to->empty()) to->resize(static_cast<size_t>(grid.crop.area()));
  CropWalk crop_index(grid);
  for (const SplatSum& splat : splats)
    add_sum(splat.sum, subtract, &(*to)[static_cast<size_t>(crop_index(splat.pixel))]);
}

}  // namespace lightmill
