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
/// Deep pixels in a cell, at least: a packet of fewer would not pay for its light paths.
constexpr int64_t kLeastDeepPixels = 16;
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

/// Cell number `i` of the film's.
CellRect cell_of_film(const CellRect& film, int64_t i) {
  const int64_t columns = film.width();
  const int x = film.x0 + static_cast<int>(i % columns), y = film.y0 + static_cast<int>(i / columns);
  return {x, y, x + 1, y + 1};
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

CellRect PilotPixels::rect(size_t i) const { return cell_of_film(film_, cells[i]); }

int64_t PilotPixels::index(int64_t j) const {
  return block_begin(kPilotBlock + block(j)) + j - block(j) * (samples / 2);
}

DeepPixels::DeepPixels(const FilmGrid& grid, int64_t pixels) : film_(grid.cells()) {
  const int64_t count = grid.cells().count(), used = std::min(count, pixels / kLeastDeepPixels);
  while (pixel_subset.one_in < kMostThinned && used * kCellPixels > pixels * pixel_subset.one_in)
    pixel_subset.one_in *= 2;
  cells = pilot_cells(count, used);
}

CellRect DeepPixels::rect(size_t i) const { return cell_of_film(film_, cells[i]); }

int64_t DeepPixels::index(int replicate, int64_t j) {
  int64_t k = 0;
  while (replicate_of(k) != ReplicateBlock{replicate, j / kSuperblockSamples}) ++k;
  return k * kSuperblockSamples + j % kSuperblockSamples;
}

}  // namespace lightmill
