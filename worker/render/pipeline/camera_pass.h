#pragma once
// Passes of camera paths over a cell. One sample index is one pass. In that of a pilot slot i is pixel i of
// the cell; otherwise the pixels are in an order in which those that lie near each other follow one another.
// Under adaptive sampling (common/job/sample_allocation.h) a pixel has none, one or several paths for an
// index. These wait until they fill a wavefront.
#include <cstdint>
#include <vector>

#include "common/job/packet_grid.h"
#include "common/job/replicates.h"
#include "common/job/sample_allocation.h"
#include "worker/render/pipeline/pixel_subset.h"

namespace lightmill {

struct StageContext;  // context.h

/// The plan's sample allocation as the stages use it.
struct AllocationTable {
  RegionGrid regions;
  SampleAllocation map;
  AllocationTable(const FilmGrid& grid, const SampleAllocation& allocation)
      : regions(regions_of(grid)), map(allocation) {}
};

/// Camera paths of a cell. Pixels are numbered row-major in the cell.
struct CameraSlots {
  // For a superblock of sample indices, by pixel.
  alignas(32) int32_t x[kCellPixels], y[kCellPixels];  // place in the image (pixel_interleave.h)
  uint32_t pixel_keys[kCellPixels];                    // of its sample stream
  int32_t inside[kCellPixels];                         // 1: in the crop window and in the pixel subset
  int32_t level[kCellPixels];                          // of the allocation
  int inside_count = 0;
  bool uneven = false;  // some level is not 0
  // For a pass, by slot.
  alignas(32) int32_t taken[kCellPixels];   // 1: has a path
  alignas(32) int32_t pixel[kCellPixels];   // of the path
  alignas(32) uint32_t keys[kCellPixels];   // its pixel's pixel_keys
  alignas(32) uint32_t index[kCellPixels];  // within the stream
  alignas(32) float weight[kCellPixels];    // of the path's contributions

  /// Starts superblock `superblock`, of those pixels that `pixel_subset` keeps.
  void begin_superblock(const StageContext& context, int cell_x, int cell_y, int64_t superblock,
                        const PixelSubset& pixel_subset);
  /// The part of that without the pixels: where the superblock's sample indices stand in their replicate.
  /// Returns what belongs to the keys of the pixels' streams.
  uint64_t begin_indices(int64_t superblock);
  /// Whether sample index `s` has a path for every pixel.
  bool is_even(int64_t s) const { return s < kUniformSamples || !uneven; }
  /// Starts the pass of an even sample index `s` of the superblock.
  void begin_even_pass(int64_t s);
  /// Adds the paths of another sample index to those that wait.
  void add_waiting(int64_t s);
  /// Starts a pass of waiting paths: as many as there are slots; with `rest`, fewer will do. Returns false if
  /// there are not enough.
  bool begin_waiting_pass(bool rest);

 private:
  /// The pixel that comes k-th in a pass, if all have a path.
  int32_t pixel_at(int k) const { return order_ ? order_[k] : k; }

  const int32_t* order_ = nullptr;  // null: row by row
  struct Waiting {
    int32_t pixel;
    uint32_t index;
  };
  /// Where sample index `s` stands among those of its replicate.
  uint32_t place(int64_t s) const { return first_place_ + static_cast<uint32_t>(s - first_sample_); }

  ReplicateBlock block_;
  int64_t first_sample_ = 0;  // of the superblock
  uint32_t first_place_ = 0;  // its place
  std::vector<Waiting> waiting_;
};

}  // namespace lightmill
