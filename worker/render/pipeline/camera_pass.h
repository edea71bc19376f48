#pragma once
// Which camera paths of a cell make up a pass, and what these stand for. A sample index is one pass, whose
// slot i is pixel i of the cell. But where effort differs (common/job/sample_allocation.h) pixels have none, one or
// several paths for an index: those wait until they fill a wavefront.
#include <cstdint>
#include <vector>

#include "common/job/sample_allocation.h"
#include "common/job/packet_grid.h"
#include "worker/render/pipeline/pixel_subset.h"

namespace lightmill {

struct StageContext;  // context.h

/// The plan's effort as the stages use it.
struct AllocationTable {
  RegionGrid regions;
  SampleAllocation map;
  AllocationTable(const FilmGrid& grid, const SampleAllocation& allocation) : regions(regions_of(grid)), map(allocation) {}
};

/// Camera paths of a cell. Pixels are numbered row-major.
struct CameraSlots {
  // Of a batch of sample indices, a superblock: by pixel.
  uint32_t pixel_keys[kCellPixels];  // of its sample stream
  int32_t inside[kCellPixels];       // 1: in the crop window, and looked at
  int32_t level[kCellPixels];        // of effort
  int inside_count = 0;
  bool uneven = false;  // some level is not 0
  // Of a pass: by slot.
  alignas(32) int32_t taken[kCellPixels];   // 1: has a path
  alignas(32) int32_t pixel[kCellPixels];   // that the path is of
  alignas(32) uint32_t keys[kCellPixels];   // pixel_keys of it
  alignas(32) uint32_t index[kCellPixels];  // within the stream
  alignas(32) float weight[kCellPixels];    // of the path's contributions

  /// Starts a batch, which looks at those pixels that `thinning` keeps.
  void begin_batch(const StageContext& context, int cell_x, int cell_y, int64_t batch,
                   const PixelSubset& pixel_subset);
  /// Whether sample index `s` has a path for every pixel.
  bool is_even(int64_t s) const { return s < kUniformSamples || !uneven; }
  /// Starts the pass of an even sample index `s` of batch `batch`.
  void begin_even_pass(int64_t batch, int64_t s);
  /// Adds the paths of another sample index to those that wait.
  void add_waiting(int64_t batch, int64_t s);
  /// Starts a pass of paths that wait: as many as there are slots, or if `rest` also fewer. False: there are
  /// not as many.
  bool begin_waiting_pass(bool rest);

 private:
  struct Waiting {
    int32_t pixel;
    uint32_t index;
  };
  std::vector<Waiting> waiting_;
};

}  // namespace lightmill
