#include "worker/render/guiding/photon_blocks.h"

#include <algorithm>
#include <bit>
#include <map>

namespace lightmill {
namespace {

/// Cells along the longest side of the grid, but one. Twice as many made no difference beyond noise.
constexpr int kMostCells = 48;

/// The first cell of the block of 2^level cells a side that `cell` is in.
size_t block_of(const LightGrid& grid, int32_t cell, int level) {
  int32_t block = 0, stride = 1;
  for (const int32_t count : grid.cells) {
    block += (cell % count >> level << level) * stride;
    cell /= count;
    stride *= count;
  }
  return static_cast<size_t>(block);
}

/// Such a block's middle and half of its longest side.
GuideBox box_of(const LightGrid& grid, size_t block, int level) {
  GuideBox box;
  auto cell = static_cast<int32_t>(block);
  for (size_t k = 0; k < 3; ++k) {
    const int32_t count = grid.cells[k], first = cell % count, last = std::min(first + (1 << level), count);
    cell /= count;
    const float per_unit = grid.per_unit[k] > 0 ? grid.per_unit[k] : 1;
    box.centre[k] = grid.origin[k] + 0.5f * static_cast<float>(first + last) / per_unit;
    if (grid.per_unit[k] > 0)
      box.half = std::max(box.half, 0.5f * static_cast<float>(last - first) / per_unit);
  }
  return box;
}

}  // namespace

PhotonGrid tabulate(const std::vector<Photon>& photons, size_t least,
                    const std::function<void(const std::vector<const Photon*>&, const GuideBox&)>& add) {
  PhotonGrid result;
  std::vector<Vec3f> points;
  points.reserve(photons.size());
  for (const Photon& p : photons) points.push_back({p.p.x, p.p.y, p.p.z});
  result.grid = place_grid(points, kMostCells);
  result.table_of.assign(static_cast<size_t>(result.grid.count()), -1);
  std::vector<int32_t> cell_of;
  cell_of.reserve(photons.size());
  for (const Photon& p : photons) cell_of.push_back(result.grid.at<float>(p.p));
  const auto levels = static_cast<int>(std::bit_width(static_cast<unsigned>(kMostCells)));
  int32_t tables = 0;
  for (int level = 0; level <= levels; ++level) {
    std::map<size_t, std::vector<size_t>> blocks;
    for (size_t i = 0; i < photons.size(); ++i) blocks[block_of(result.grid, cell_of[i], level)].push_back(i);
    for (const auto& [block, members] : blocks) {
      const auto waits = [&](size_t i) { return result.table_of[static_cast<size_t>(cell_of[i])] < 0; };
      if (members.size() < least || std::none_of(members.begin(), members.end(), waits)) continue;
      std::vector<const Photon*> own;
      for (const size_t i : members) own.push_back(&photons[i]);
      add(own, box_of(result.grid, block, level));
      for (const size_t i : members) {
        if (waits(i)) result.table_of[static_cast<size_t>(cell_of[i])] = tables;
      }
      ++tables;
    }
  }
  return result;
}

}  // namespace lightmill
