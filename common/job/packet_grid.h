#pragma once
// The absolute grid of packets: cells of 32x32 pixels x blocks of sample indices. The pixels of a cell do not
// lie beside each other in the image: pixel_interleave.h.
//
// Block b covers sample indices 0 | 1 | 2-3 | 4-7 | 8-15 | 16-31 | 32-47 | ... (sizes 1,1,2,4,8, then 16
// each). Cells sit at absolute multiples of 32 pixels of the *uncropped* film, so a packet has the same
// identity under any crop, tiling, round or extension. Sixteen samples (blocks 0-4 together, then each later
// block) are one *superblock*: the unit of batches and of error points.
#include <algorithm>
#include <array>
#include <cstdint>

namespace lightmill {

inline constexpr int kCellSize = 32;
inline constexpr int kCellPixels = kCellSize * kCellSize;
inline constexpr int64_t kSuperblockSamples = 16;

/// Half-open pixel rectangle [x0,x1) x [y0,y1).
struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  constexpr int width() const { return x1 - x0; }
  constexpr int height() const { return y1 - y0; }
  constexpr int64_t area() const { return int64_t{width()} * height(); }
  constexpr bool empty() const { return x1 <= x0 || y1 <= y0; }
  bool operator==(const PixelRect&) const = default;
};

/// Half-open rectangle of cells, in units of kCellSize pixels.
struct CellRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  constexpr int width() const { return x1 - x0; }
  constexpr int height() const { return y1 - y0; }
  constexpr int64_t count() const { return int64_t{width()} * height(); }
  bool operator==(const CellRect&) const = default;
};

/// Film resolution and the crop window that is rendered.
struct FilmGrid {
  int width = 0, height = 0;
  PixelRect crop;           // within [0,width) x [0,height); equal to it without a crop
  bool interleaved = true;  // see pixel_interleave.h; false in jobs of versions that did not do it
  bool operator==(const FilmGrid&) const = default;

  /// Cells that the crop window touches.
  CellRect cells() const {
    return {crop.x0 / kCellSize, crop.y0 / kCellSize, (crop.x1 + kCellSize - 1) / kCellSize,
            (crop.y1 + kCellSize - 1) / kCellSize};
  }
  /// Pixels of the cells of `r` that lie in the crop window.
  PixelRect pixels(const CellRect& r) const {
    return {std::max(r.x0 * kCellSize, crop.x0), std::max(r.y0 * kCellSize, crop.y0),
            std::min(r.x1 * kCellSize, crop.x1), std::min(r.y1 * kCellSize, crop.y1)};
  }
  /// Index of uncropped pixel `pixel` = y * width + x in the row-major crop window, or -1 outside of it.
  int64_t crop_index(uint32_t pixel) const {
    const int64_t x = pixel % static_cast<uint32_t>(width) - int64_t{crop.x0};
    const int64_t y = pixel / static_cast<uint32_t>(width) - int64_t{crop.y0};
    if (x < 0 || y < 0 || x >= crop.width() || y >= crop.height()) return -1;
    return y * crop.width() + x;
  }
  /// Light paths traced per unit of spp: one per pixel of the crop window.
  int64_t light_paths_per_spp() const { return crop.area(); }
};

/// Most light paths that a plan traces per camera path (common/job/sampling_plan.h).
inline constexpr uint64_t kMaxLightPathsPerSample = 2;

/// Block that holds sample index `s` (s >= 0).
constexpr int64_t block_of_sample(int64_t s) {
  if (s >= 16) return 5 + (s - 16) / 16;
  if (s < 1) return 0;
  int64_t b = 0;
  while ((int64_t{1} << b) <= s) ++b;
  return b;
}
/// First sample index of block `b`.
constexpr int64_t block_begin(int64_t b) {
  if (b <= 0) return 0;
  return b < 5 ? int64_t{1} << (b - 1) : 16 + (b - 5) * 16;
}
/// One past the last sample index of block `b`.
constexpr int64_t block_end(int64_t b) { return block_begin(b + 1); }
/// Number of blocks that `spp` samples touch (the last may be cut).
constexpr int64_t block_count(int64_t spp) { return spp <= 0 ? 0 : block_of_sample(spp - 1) + 1; }
constexpr int64_t superblock_of_sample(int64_t s) { return s / kSuperblockSamples; }

/// A sample tile: cells x sample indices. The unit of lease, retry and merge. The range may begin or end
/// inside a block (a job of 40 spp, later extended). Sums are exact per contribution, so that does not show.
struct TileSpec {
  CellRect cells;
  int64_t sample_begin = 0, sample_end = 0;
  bool operator==(const TileSpec&) const = default;
  constexpr int64_t samples() const { return sample_end - sample_begin; }
};

/// Number of packets that `tile` *completes* in a job of `spp` samples: blocks whose last sample (cut at spp)
/// lies in the tile's range, times its cells. Summed over a ledger this never counts a packet twice, not even
/// after an extension.
constexpr int64_t packets_completed(const TileSpec& tile, int64_t spp) {
  int64_t blocks = 0;
  for (int64_t b = block_of_sample(tile.sample_begin); block_begin(b) < tile.sample_end; ++b) {
    const int64_t end = std::min(block_end(b), spp);
    if (end > tile.sample_begin && end <= tile.sample_end) ++blocks;
  }
  return blocks * tile.cells.count();
}

}  // namespace lightmill
