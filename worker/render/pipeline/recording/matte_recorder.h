#pragma once
// Counts what a packet's camera samples hit first, for Cryptomatte (common/film/cryptomatte/matte_sums.h).
#include <array>
#include <vector>

#include "common/film/cryptomatte/matte_sums.h"
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

class MatteRecorder {
 public:
  void begin_packet();
  /// What the sample of a path slot hits first.
  void hit(size_t slot, MatteKey key) { keys_[slot] = key; }
  /// Counts it for pixel `pixel` of the cell.
  void add(size_t pixel, size_t slot, uint64_t count);
  /// The packet's counts.
  MatteCell cell();

 private:
  std::array<MatteKey, kWavefront> keys_{};                  // by slot
  std::array<std::vector<MatteCount>, kCellPixels> counts_;  // by pixel: few each, in the order of samples
};

}  // namespace lightmill
