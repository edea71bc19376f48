#include "common/job/sample_allocation.h"

#include <algorithm>

#include "common/base/error.h"
#include "common/job/pixel_interleave.h"

namespace lightmill {

RegionGrid regions_of(const FilmGrid& grid) {
  const CellRect cells = grid.cells();
  RegionGrid r{4, cells.x0 * kCellSize, cells.y0 * kCellSize, 0, 0};
  do {
    r.side *= 2;
    r.columns = (cells.width() * kCellSize + r.side - 1) / r.side;
    r.rows = (cells.height() * kCellSize + r.side - 1) / r.side;
  } while (r.count() > kMaxRegions);
  return r;
}

void check_allocation(const SampleAllocation& map) {
  if (map.levels.size() > static_cast<size_t>(kMaxRegions))
    throw Error(ErrorKind::kUsage, "sampling plan: sample_allocation has more than 4096 regions");
  for (const char c : map.levels) {
    if (c < '0' || c > '0' + kMostLevel - kLeastLevel)
      throw Error(ErrorKind::kUsage, "sampling plan: sample_allocation must consist of the digits 0 to 4");
  }
}

void check_allocation(const SampleAllocation& map, const FilmGrid& grid) {
  if (map.uniform() || static_cast<int64_t>(map.levels.size()) == regions_of(grid).count()) return;
  throw Error(
      ErrorKind::kUsage,
      "sampling plan: its samples were allocated for another resolution or crop; add --uniform-sampling to "
      "leave it out");
}

PathCount camera_paths_of(const SampleAllocation& map, const FilmGrid& grid, const TileSpec& tile) {
  const PixelRect pixels = grid.pixels(tile.cells);
  if (map.uniform()) {
    const auto n = static_cast<uint64_t>(pixels.area()) * static_cast<uint64_t>(tile.samples());
    return {n, n};
  }
  const RegionGrid regions = regions_of(grid);
  const PixelInterleave interleave(grid);
  std::vector<uint64_t> areas(static_cast<size_t>(regions.count()));
  for (int y = pixels.y0; y < pixels.y1; ++y) {
    for (int x = pixels.x0; x < pixels.x1; ++x) {
      const FilmPixel p = interleave.to_film(x, y);
      ++areas[static_cast<size_t>(regions.at(p.x, p.y))];
    }
  }
  const int64_t begin = std::max(tile.sample_begin, kUniformSamples),
                end = std::max(tile.sample_end, kUniformSamples);
  const int64_t uniform = tile.samples() - (end - begin);
  PathCount count;
  for (int64_t r = 0; r < regions.count(); ++r) {
    const uint64_t area = areas[static_cast<size_t>(r)];
    if (area == 0) continue;
    const int level = map.level(r), more = std::max(level, 0), less = std::max(-level, 0);
    const int64_t group = int64_t{1} << less, all = (end - begin) << more;
    const int64_t whole = std::max<int64_t>(end / group - (begin + group - 1) / group, 0),
                  touched = begin < end ? (end + group - 1) / group - begin / group : 0;
    count.least += area * static_cast<uint64_t>(uniform + (less > 0 ? whole : all));
    count.most += area * static_cast<uint64_t>(uniform + (less > 0 ? touched : all));
  }
  return count;
}

}  // namespace lightmill
