#pragma once
// What a look at a scene before its render takes in: cells of the film, few of their pixels where there are
// many, a few samples of each.
#include <cstdint>
#include <vector>

#include "common/image/grid.h"
#include "worker/render/pipeline/thinning.h"

namespace lightmill {

struct PilotSight {
  /// Samples per pixel of the cells that it takes.
  static constexpr int64_t kLeastSamples = 2, kMostSamples = 32;
  static constexpr int64_t kLeastWeighed = 8;
  /// Camera paths that a pilot traces at most.
  static constexpr int64_t kPilotPaths = 3 << 16;

  int64_t samples = kLeastSamples;
  /// Pixels are looked at in squares whose values are known from kLeastWeighed camera paths at least: what a
  /// sample is weighed by.
  Thinning thinning;
  std::vector<int64_t> cells;  // row-major in those of the film

  /// Of at most `paths` camera paths.
  explicit PilotSight(const FilmGrid& grid, int64_t paths = kPilotPaths);
  CellRect rect(size_t i) const;  // of cells[i]
  double paths_per_pixel() const { return static_cast<double>(samples) / thinning.one_in; }
  /// Sample index number `j` of those taken: half of them are of one block, half of the next.
  int block(int64_t j) const { return j < samples / 2 ? 0 : 1; }
  int64_t index(int64_t j) const;

 private:
  CellRect film_;
};

}  // namespace lightmill
