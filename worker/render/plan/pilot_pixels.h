#pragma once
// The pixels that a pilot or a preview pass renders: some cells of the film, a part of their pixels where
// there are many, and a few samples of each.
#include <cstdint>
#include <vector>

#include "common/job/packet_grid.h"
#include "worker/render/pipeline/pixel_subset.h"

namespace lightmill {

struct PilotPixels {
  static constexpr int64_t kMostSamples = 32;

  int64_t samples;  // per pilot pixel
  PixelSubset pixel_subset;
  std::vector<int64_t> cells;  // row-major in those of the film

  /// At most `paths` camera paths in all. Where there are many pixels, a part of them gets at least
  /// `least_samples` each, a power of two from 2 on. Few samples per pixel show more places; many show what
  /// stratification gains.
  PilotPixels(const FilmGrid& grid, int64_t paths, int64_t least_samples = 2);
  CellRect rect(size_t i) const;  // of cells[i]
  double paths_per_pixel() const { return static_cast<double>(samples) / pixel_subset.one_in; }
  /// Block (0 or 1) of sample number `j` of a pixel: half of the samples are of one block, half of the next.
  int block(int64_t j) const { return j < samples / 2 ? 0 : 1; }
  int64_t index(int64_t j) const;

 private:
  CellRect film_;
};

/// The pixels of which a pilot takes many samples in both replicates: a few of some cells.
struct DeepPixels {
  PixelSubset pixel_subset;
  std::vector<int64_t> cells;  // row-major in those of the film

  /// About `pixels` of them, if the film has as many.
  DeepPixels(const FilmGrid& grid, int64_t pixels);
  CellRect rect(size_t i) const;  // of cells[i]
  /// Sample index number `j` < 64 of this replicate.
  static int64_t index(int replicate, int64_t j);

 private:
  CellRect film_;
};

}  // namespace lightmill
