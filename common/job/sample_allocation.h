#pragma once
// Sample allocation (adaptive sampling): how many camera samples a region of the image gets for each unit of
// spp. It is part of the sampling plan, fixed before the first sample of the image. So no sample decides
// about the samples that it is averaged with (Kirk and Arvo, "Unbiased Sampling Techniques for Image
// Synthesis", 1991).
//
// Sample indices count units of spp everywhere (tiles, ledger, batches, extend). From kUniformSamples on, a
// region of level L > 0 takes 2^L camera samples for each index. A region of level L < 0 takes one for 2^-L
// consecutive indices, at an index drawn per pixel. Samples carry the weight 2^-L. So sums are divided by spp
// everywhere, and any range of indices is unbiased.
#include <string>

#include "common/job/packet_grid.h"

namespace lightmill {

/// Levels are kLeastLevel .. kMostLevel: a quarter to four samples.
inline constexpr int kLeastLevel = -2, kMostLevel = 2;
inline constexpr int kMaxSamplesPerIndex = 1 << kMostLevel;
/// The first indices have one sample per pixel everywhere: a picture without holes from the start. A multiple
/// of four; later blocks are multiples of four, too.
inline constexpr int64_t kUniformSamples = 4;
/// Most regions of a film.
inline constexpr int64_t kMaxRegions = 4096;

/// The regions of a film: squares of `side` pixels, a power of two, from the first pixel of the first cell of
/// the crop window on.
struct RegionGrid {
  int side = 0, x0 = 0, y0 = 0, columns = 0, rows = 0;
  int64_t count() const { return int64_t{columns} * rows; }
  /// Region of pixel (x, y) of the uncropped film; in range for every pixel of the crop window's cells.
  int64_t at(int x, int y) const { return int64_t{(y - y0) / side} * columns + (x - x0) / side; }
};
/// The smallest regions, from 8 pixels on, of which there are at most kMaxRegions.
RegionGrid regions_of(const FilmGrid& grid);

/// A level per region, row-major. Empty: one sample everywhere.
struct SampleAllocation {
  std::string levels;  // '0' for kLeastLevel and so on
  bool uniform() const { return levels.empty(); }
  int level(int64_t region) const {
    return uniform() ? 0 : levels[static_cast<size_t>(region)] - '0' + kLeastLevel;
  }
  void set_level(int64_t region, int level) {
    levels[static_cast<size_t>(region)] = static_cast<char>('0' + level - kLeastLevel);
  }
  bool operator==(const SampleAllocation&) const = default;
};

/// Throws Error(kUsage) unless the levels are in range and at most kMaxRegions.
void check_allocation(const SampleAllocation& map);
/// Throws Error(kUsage) if the map was made for regions of another film. A uniform map fits all.
void check_allocation(const SampleAllocation& map, const FilmGrid& grid);

/// Least and most camera paths that a tile can have. They differ where its range cuts the groups of indices
/// of which regions below one sample per index draw one.
struct PathCount {
  uint64_t least = 0, most = 0;
};
PathCount camera_paths_of(const SampleAllocation& map, const FilmGrid& grid, const TileSpec& tile);

}  // namespace lightmill
