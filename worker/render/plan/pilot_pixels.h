#pragma once
// What a look at a scene before its render takes in: cells of the film, few of their pixels where there are
// many, a few samples of each.
#include <cstdint>
#include <vector>

#include "common/job/packet_grid.h"
#include "worker/render/pipeline/pixel_subset.h"

namespace lightmill {

struct PilotPixels {
  static constexpr int64_t kMostSamples = 32;

  int64_t samples;  // per pixel that it looks at
  PixelSubset pixel_subset;
  std::vector<int64_t> cells;  // row-major in those of the film

  /// Of at most `paths` camera paths; of many pixels some, by at least `least_samples` each, a power of two
  /// from 2 on. Few samples show more places, many what stratification gains.
  PilotPixels(const FilmGrid& grid, int64_t paths, int64_t least_samples = 2);
  CellRect rect(size_t i) const;  // of cells[i]
  double paths_per_pixel() const { return static_cast<double>(samples) / pixel_subset.one_in; }
  /// Sample index number `j` of those taken: half of them are of one block, half of the next.
  int block(int64_t j) const { return j < samples / 2 ? 0 : 1; }
  int64_t index(int64_t j) const;

 private:
  CellRect film_;
};

}  // namespace lightmill
