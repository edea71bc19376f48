#pragma once
// What a pilot looks at: cells of the film, one in so many of their pixels, a few samples of each.
#include <cstdint>
#include <vector>

#include "common/image/grid.h"

namespace lightmill {

struct PilotSight {
  /// Samples per pixel of the cells that it takes.
  static constexpr int64_t kLeastSamples = 2, kMostSamples = 32;

  int64_t samples = kLeastSamples;
  uint32_t one_in = 1;
  std::vector<int64_t> cells;

  explicit PilotSight(const FilmGrid& grid);
  double paths_per_pixel() const { return static_cast<double>(samples) / one_in; }
  /// Sample index number `j` of those taken: half of them are of one block, half of the next.
  int block(int64_t j) const { return j < samples / 2 ? 0 : 1; }
  int64_t index(int64_t j) const;
};

}  // namespace lightmill
