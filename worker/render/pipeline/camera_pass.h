#pragma once
// Which pixels of a cell get a camera path in a pass over it, and what these stand for. A sample index is one
// pass, or several where a region of the cell gets more than one sample for it (common/effort_map.h).
#include <cstdint>
#include <vector>

#include "common/effort_map.h"
#include "common/image/grid.h"
#include "worker/render/pipeline/thinning.h"

namespace lightmill {

struct StageContext;  // context.h

/// The plan's effort as the stages use it.
struct EffortTable {
  RegionGrid regions;
  EffortMap map;
  std::vector<float> light_samples;  // n_light of mis.h for the pixels of a region

  /// `light_samples`: light paths of the whole film per unit of spp.
  EffortTable(const FilmGrid& grid, const EffortMap& effort, float light_samples);
  float light_samples_at(int x, int y) const { return light_samples[static_cast<size_t>(regions.at(x, y))]; }
};

/// Camera paths of a cell, by slot: the pixel within the cell, row-major.
struct CameraSlots {
  // Of a batch of sample indices: a superblock.
  alignas(32) uint32_t keys[kCellPixels];        // of the pixel's sample stream
  alignas(32) int32_t inside[kCellPixels];       // 1: a pixel of the crop window, and looked at
  alignas(32) int32_t level[kCellPixels];        // of effort
  alignas(32) float light_samples[kCellPixels];  // n_light of mis.h
  int inside_count = 0, least_level = 0, most_level = 0;
  // Of a pass.
  alignas(32) uint32_t index[kCellPixels];  // within the stream
  alignas(32) int32_t taken[kCellPixels];   // 1: has a path
  alignas(32) float weight[kCellPixels];    // of its contributions

  /// Starts a batch, which looks at those pixels that `thinning` keeps.
  void begin_batch(const StageContext& context, int cell_x, int cell_y, int64_t batch,
                   const Thinning& thinning);
  /// Passes that sample index `s` takes.
  int passes(int64_t s) const { return s < kUniformSamples ? 1 : 1 << (most_level > 0 ? most_level : 0); }
  /// Starts pass `pass` of sample index `s` of batch `batch`.
  void begin_pass(int64_t batch, int64_t s, int pass);
};

}  // namespace lightmill
