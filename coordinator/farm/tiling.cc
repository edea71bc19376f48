#include "coordinator/farm/tiling.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/error/checkpoints.h"
#include "common/job/replicates.h"

namespace lightmill {
namespace {

// First tiles: small enough for a first picture within a second or two on any machine.
constexpr int64_t kFirstTileSamples = 16 * kCellPixels;
// Ones with splats, of which each brings a layer as large as the window: larger, and fewer.
constexpr int64_t kFirstSplatTileSamples = 8 * kFirstTileSamples;
constexpr int64_t kMaxTilesPerRound = 4096;
constexpr int64_t kMaxGrowth = 2, kMaxSplatGrowth = 16;
// From the first round to the second if that is planned before a speed is known: without splats small tiles
// cost little.
constexpr int64_t kBlindSplatGrowth = 8;
// A splat layer costs what rendering a sample for every second or third pixel of the window costs. Samples
// for every pixel, in a tile that holds as many as are worth waiting for, and in one that is small for the
// job's end:
constexpr int64_t kFullSplatSpp = 16, kLeastSplatSpp = 5;
constexpr double kSplatTileFactor = 16;  // times target_tile_seconds, at most

/// Samples of a tile while there is enough to do.
int64_t tile_budget(const TilingInput& in) {
  if (in.previous_tile_samples <= 0) return in.splats ? kFirstSplatTileSamples : kFirstTileSamples;
  const int64_t grown = in.previous_tile_samples * (in.splats ? kMaxSplatGrowth : kMaxGrowth);
  int64_t budget = in.previous_tile_samples;
  if (in.splats && budget < kBlindSplatGrowth * kFirstSplatTileSamples) budget *= kBlindSplatGrowth;
  if (in.worker_samples_per_second > 0) {
    double wanted = in.worker_samples_per_second * in.target_tile_seconds;
    if (in.splats) {
      const auto full = static_cast<double>(kFullSplatSpp * in.grid.crop.area());
      wanted = std::clamp(full, wanted, wanted * kSplatTileFactor);
    }
    budget = std::min(grown, static_cast<int64_t>(std::clamp(wanted, 1.0, 0x1p50)));
  }
  return in.splats ? std::max(budget, in.min_tile_samples) : budget;
}

/// Samples per pixel that fit the time left.
double affordable_spp(const TilingInput& in) {
  if (in.seconds_left < 0 || !(in.worker_samples_per_second > 0)) return 0x1p50;
  const double rate = in.worker_samples_per_second * std::max(1, in.workers);
  return in.seconds_left * rate / static_cast<double>(in.grid.crop.area());
}

/// Where a round has to end, so that a film of no more than a superblock has two halves.
int64_t first_half_end(int64_t spp) {
  const int64_t samples = std::min(spp, kSuperblockSamples);
  return samples < 2 ? samples : static_cast<int64_t>(std::bit_floor(static_cast<uint64_t>(samples - 1)));
}

/// End of the blocks within the first superblock that are a round together.
int64_t first_range_end(const TilingInput& in, double round_budget) {
  int64_t end = block_end(block_of_sample(in.begin));
  if (!in.splats || in.begin == 0) return end;
  while (end < kSuperblockSamples && !(in.halves && end == first_half_end(in.spp))) {
    const int64_t longer = block_end(block_of_sample(end));
    const auto samples = static_cast<double>((longer - in.begin) * in.grid.crop.area());
    if (samples > round_budget) break;
    end = longer;
  }
  return end;
}

int64_t range_end(const TilingInput& in, int64_t budget) {
  const int64_t pixels = in.grid.crop.area();
  const double round_budget = 2.0 * std::max(1, in.workers) * static_cast<double>(budget);
  int64_t end = 0;
  if (in.begin < kSuperblockSamples) {
    end = first_range_end(in, round_budget);
  } else {
    const int64_t first = superblock_of_sample(in.begin);
    const int64_t group = std::max({int64_t{1}, in.max_superblocks, in.min_superblocks});
    // Where cells are few for the workers, a tile of a single one need not be deeper than a target tile; a
    // power of two, which groups are cut into without a rest: shorter tiles would be more commits than
    // planned.
    const double cell =
        std::ceil(static_cast<double>(budget) /
                  static_cast<double>(std::min<int64_t>(kCellPixels, pixels) * kSuperblockSamples));
    const auto enough = static_cast<double>(
        std::bit_ceil(static_cast<uint64_t>(std::clamp(cell, 1.0, static_cast<double>(group)))));
    const double fits = std::min(
        enough, round_budget / (static_cast<double>(pixels) * static_cast<double>(kSuperblockSamples)));
    const auto count =
        std::max(in.min_superblocks, static_cast<int64_t>(std::clamp(fits, 1.0, static_cast<double>(group))));
    end =
        std::min({first + count, (first / group + 1) * group, replicate_run_end(first)}) * kSuperblockSamples;
  }
  if (in.to_checkpoint) {
    end = std::min(end,
                   in.denoised_checkpoint ? next_denoised_checkpoint(in.begin) : next_checkpoint(in.begin));
  }
  end = std::min(end, in.spp);
  const double affordable = affordable_spp(in);
  // A first picture is owed in any case.
  if (affordable < 0.5 && in.begin > 0) return in.begin;
  if (affordable < static_cast<double>(end - in.begin)) {
    end = in.begin + std::max<int64_t>(1, static_cast<int64_t>(affordable));
  }
  return end;
}

/// Tiles of a round with splats over [in.begin, end).
int64_t splat_tiles(const TilingInput& in, int64_t budget, int64_t end) {
  const auto pixels = static_cast<double>(in.grid.crop.area());
  const double samples = pixels * static_cast<double>(end - in.begin);
  const auto workers = static_cast<double>(std::max(1, in.workers));
  // What can be leased before somebody has to wait. Nothing is after a checkpoint before it was looked at.
  const double left =
      in.to_checkpoint
          ? samples
          : std::max(samples, pixels * std::min(static_cast<double>(in.spp - in.begin), affordable_spp(in)));
  const double least =
      std::max(pixels * static_cast<double>(kLeastSplatSpp), static_cast<double>(in.min_tile_samples));
  const double tile =
      std::max(1.0, std::min(static_cast<double>(budget), std::max(least, left / (2 * workers))));
  const double count = std::max(std::round(samples / tile), std::ceil(samples * workers / left));
  return static_cast<int64_t>(std::clamp(count, 1.0, 1e9));
}

}  // namespace

std::vector<CellRect> split_cells(const CellRect& cells, int64_t count) {
  const int width = cells.width(), height = cells.height();
  count = std::clamp<int64_t>(count, 1, cells.count());
  const double side = std::sqrt(static_cast<double>(cells.count()) / static_cast<double>(count));
  int columns = static_cast<int>(std::clamp(std::ceil(width / std::max(1.0, std::floor(side))), 1.0,
                                            static_cast<double>(std::min<int64_t>(width, count))));
  const auto rows = static_cast<int>(std::min<int64_t>(height, (count + columns - 1) / columns));
  columns = static_cast<int>(std::min<int64_t>(width, (count + rows - 1) / rows));
  const auto cut = [](int from, int length, int parts, int i) {
    return from + static_cast<int>(int64_t{length} * i / parts);
  };
  std::vector<CellRect> parts;
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      parts.push_back({cut(cells.x0, width, columns, x), cut(cells.y0, height, rows, y),
                       cut(cells.x0, width, columns, x + 1), cut(cells.y0, height, rows, y + 1)});
    }
  }
  return parts;
}

std::vector<TileSpec> plan_round(const TilingInput& in) {
  const int64_t budget = tile_budget(in);
  const int64_t end = range_end(in, budget);
  if (end <= in.begin) return {};
  const CellRect cells = in.grid.cells();
  int64_t count = 0;
  if (in.splats) {
    count = splat_tiles(in, budget, end);
  } else {
    const double samples = static_cast<double>(in.grid.crop.area()) * static_cast<double>(end - in.begin);
    count = static_cast<int64_t>(std::min(std::ceil(samples / static_cast<double>(budget)), 1e9));
    count = std::max<int64_t>(count, 2 * int64_t{std::max(1, in.workers)});
  }
  count = std::min({count, cells.count(), kMaxTilesPerRound});
  std::vector<TileSpec> tiles;
  for (const CellRect& part : split_cells(cells, count)) tiles.push_back({part, in.begin, end});
  return tiles;
}

}  // namespace lightmill
