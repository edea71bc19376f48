#include "worker/render/plan/pilot_pixels.h"

#include <algorithm>

#include "common/job/replicates.h"
#include "worker/render/sampling/sobol.h"

namespace lightmill {
namespace {

/// The pilot takes at least one of this many pixels of a large image; beyond that it takes fewer cells.
constexpr uint32_t kMostThinned = 64;
/// Half of the pilot's samples are of this block of 16 samples (in an image), the other half of the next one.
constexpr int64_t kPilotBlock = 5;
// Two superblocks of different replicates, or the two would not be independent.
static_assert(replicate_of(superblock_of_sample(block_begin(kPilotBlock))).replicate !=
              replicate_of(superblock_of_sample(block_begin(kPilotBlock + 1))).replicate);
constexpr uint32_t kCellSeed = 0x696c6f74;

/// The cells that the pilot renders: at most `count`, spread evenly but without a pattern.
std::vector<int64_t> pilot_cells(int64_t cells, int64_t count) {
  std::vector<int64_t> chosen;
  for (int64_t i = 0; i < count; ++i) {
    const int64_t begin = i * cells / count, end = (i + 1) * cells / count;
    const uint32_t h = hash32(static_cast<uint32_t>(i) ^ kCellSeed);
    chosen.push_back(begin + static_cast<int64_t>(h % static_cast<uint32_t>(end - begin)));
  }
  return chosen;
}

}  // namespace

PilotPixels::PilotPixels(const FilmGrid& grid, int64_t paths, int64_t least_samples)
    : samples(least_samples), film_(grid.cells()) {
  const int64_t pixels = grid.crop.area(), count = grid.cells().count();
  while (samples < kMostSamples && 2 * samples * pixels <= paths) samples *= 2;
  uint32_t& one_in = pixel_subset.one_in;
  while (one_in < kMostThinned && samples * pixels > paths * one_in) one_in *= 2;
  cells = pilot_cells(count, std::min(count, paths * one_in / (samples * kCellPixels)));
}

CellRect PilotPixels::rect(size_t i) const {
  const int64_t columns = film_.width();
  const int x = film_.x0 + static_cast<int>(cells[i] % columns),
            y = film_.y0 + static_cast<int>(cells[i] / columns);
  return {x, y, x + 1, y + 1};
}

int64_t PilotPixels::index(int64_t j) const {
  return block_begin(kPilotBlock + block(j)) + j - block(j) * (samples / 2);
}

}  // namespace lightmill
