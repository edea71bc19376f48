#include "worker/render/plan/pilot_values.h"

#include <algorithm>
#include <utility>

namespace lightmill {
namespace {

template <class F>
void for_pixels(const PixelRect& rect, F&& f) {
  for (int y = rect.y0; y < rect.y1; ++y) {
    for (int x = rect.x0; x < rect.x1; ++x) f(x, y);
  }
}
size_t slot_of(int x, int y) { return static_cast<size_t>((y % kCellSize) * kCellSize + x % kCellSize); }
void add_to(Channels* sum, const Channels& rgb) {
  for (size_t ch = 0; ch < 3; ++ch) (*sum)[ch] += rgb[ch];
}

}  // namespace

void CellLook::add(const std::vector<StrategyContribution>& contributions, uint64_t more_light_paths) {
  light_paths += more_light_paths;
  for (const StrategyContribution& c : contributions) {
    const Channels rgb{c.rgb[0], c.rgb[1], c.rgb[2]};
    if (c.t == 1) {
      splats.push_back({c.pixel, rgb});
    } else {
      add_to(&pixels[static_cast<size_t>(c.slot)], rgb);
    }
  }
}

PilotValues::PilotValues(const FilmGrid& grid, const PilotSight& sight)
    : grid_(grid),
      sight_(sight),
      weights_(grid, sight.paths_per_pixel(), PilotSight::kLeastWeighed),
      cells_(sight.cells.size()) {}

/// f(rect) of the squares of a cell that are looked at, as far as they are in the crop window, row-major.
template <class F>
void PilotValues::for_squares(const CellRect& cell, F&& f) const {
  const PixelRect crop = grid_.pixels(cell);
  const int side = sight_.thinning.side;
  for (int y = cell.y0 * kCellSize; y < cell.y1 * kCellSize; y += side) {
    for (int x = cell.x0 * kCellSize; x < cell.x1 * kCellSize; x += side) {
      const PixelRect square{std::max(x, crop.x0), std::max(y, crop.y0), std::min(x + side, crop.x1),
                             std::min(y + side, crop.y1)};
      if (!square.empty() && sight_.thinning.keeps(grid_.width, x, y)) f(square);
    }
  }
}

void PilotValues::take(size_t i, CellLook look) {
  Cell& cell = cells_[i];
  for_squares(sight_.rect(i), [&](const PixelRect& square) {
    Channels& sum = cell.squares.emplace_back();
    for_pixels(square, [&](int x, int y) { add_to(&sum, look.pixels[slot_of(x, y)]); });
  });
  cell.splats = std::move(look.splats);
  cell.light_paths = look.light_paths;
}

void PilotValues::finish() {
  uint64_t light_paths = 0;
  for (const Cell& cell : cells_) light_paths += cell.light_paths;
  // Of a pixel's samples; splats, over as many, stem from so many light paths.
  if (light_paths > 0)
    weights_.set_per_splat(static_cast<double>(grid_.light_paths_per_spp()) * sight_.paths_per_pixel() /
                           static_cast<double>(light_paths));
  const auto width = static_cast<uint32_t>(grid_.width);
  for (size_t i = 0; i < cells_.size(); ++i) {
    Cell& cell = cells_[i];
    for_pixels(grid_.pixels(sight_.rect(i)), [&](int x, int y) { weights_.look_at(x, y); });
    size_t k = 0;
    for_squares(sight_.rect(i), [&](const PixelRect& square) {
      weights_.add_camera(square.x0, square.y0, cell.squares[k++]);
    });
    for (const CellLook::Splat& splat : cell.splats)
      weights_.add_splat(static_cast<int>(splat.pixel % width), static_cast<int>(splat.pixel / width),
                         splat.rgb);
    cell.splats = {};
  }
  weights_.finish();
}

std::array<PixelValue, kCellPixels> PilotValues::of_cell(size_t i) const {
  std::array<PixelValue, kCellPixels> values{};
  size_t k = 0;
  for_squares(sight_.rect(i), [&](const PixelRect& square) {
    const auto paths = static_cast<float>(square.area() * sight_.samples);
    const PixelValue value = weights_.of(square.x0, square.y0, cells_[i].squares[k++], paths);
    for_pixels(square, [&](int x, int y) { values[slot_of(x, y)] = value; });
  });
  return values;
}

}  // namespace lightmill
