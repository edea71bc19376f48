#include "worker/render/plan/pilot_values.h"

#include <algorithm>
#include <utility>

namespace lightmill {
namespace {

size_t slot_of(int x, int y) { return static_cast<size_t>((y % kCellSize) * kCellSize + x % kCellSize); }
void add_to(Channels* sum, const Channels& rgb) {
  for (size_t ch = 0; ch < 3; ++ch) (*sum)[ch] += rgb[ch];
}

/// Camera paths that a square of pixels has at least, so that its value is known well enough to weigh by.
constexpr double kLeastWeighed = 8;

}  // namespace

void CellPreview::add(const std::vector<StrategyContribution>& contributions, uint64_t more_light_paths) {
  light_paths += more_light_paths;
  for (const StrategyContribution& c : contributions) {
    const Channels rgb{c.rgb[0], c.rgb[1], c.rgb[2]};
    if (c.t == 1) {
      splats.push_back({c.pixel, rgb, c.s == 1 ? c.shares.lens / std::max(c.shares.hit, 1e-6f) : 0});
    } else {
      add_to(&pixels[static_cast<size_t>(c.slot)], rgb);
    }
  }
}

PilotValues::PilotValues(const FilmGrid& grid, const PilotPixels& pilot_pixels)
    : grid_(grid),
      pilot_pixels_(pilot_pixels),
      weights_(grid, pilot_pixels.paths_per_pixel(), kLeastWeighed),
      cells_(pilot_pixels.cells.size()) {}

/// f(x, y) of the pixels of a cell in the crop window.
template <class F>
void PilotValues::for_pixels(size_t i, F&& f) const {
  const PixelRect rect = grid_.pixels(pilot_pixels_.rect(i));
  for (int y = rect.y0; y < rect.y1; ++y) {
    for (int x = rect.x0; x < rect.x1; ++x) f(x, y);
  }
}
/// The same for those that are pilot pixels.
template <class F>
void PilotValues::for_seen(size_t i, F&& f) const {
  for_pixels(i, [&](int x, int y) {
    if (pilot_pixels_.pixel_subset.keeps(x, y)) f(x, y);
  });
}

void PilotValues::take(size_t i, CellPreview preview) {
  Cell& cell = cells_[i];
  for_seen(i, [&](int x, int y) { cell.seen.push_back(preview.pixels[slot_of(x, y)]); });
  cell.splats = std::move(preview.splats);
  cell.light_paths = preview.light_paths;
}

void PilotValues::finish() {
  uint64_t light_paths = 0;
  for (const Cell& cell : cells_) light_paths += cell.light_paths;
  if (light_paths > 0)
    per_splat_ = static_cast<double>(grid_.light_paths_per_spp()) / static_cast<double>(light_paths);
  weights_.set_per_splat(per_splat_ * pilot_pixels_.paths_per_pixel());
  for (size_t i = 0; i < cells_.size(); ++i) {
    Cell& cell = cells_[i];
    for_pixels(i, [&](int x, int y) { weights_.preview_cell(x, y); });
    size_t k = 0;
    for_seen(i, [&](int x, int y) { weights_.add_camera(x, y, cell.seen[k++]); });
    add_splats(cell.splats);
    cell.splats = {};
  }
  weights_.finish();
  // Splats of one pixel are summed. The stable order gives the same sum whichever thread rendered them.
  std::stable_sort(emission_.begin(), emission_.end(),
                   [](const Emission& a, const Emission& b) { return a.pixel < b.pixel; });
  size_t last = 0;
  for (size_t i = 1; i < emission_.size(); ++i) {
    if (emission_[i].pixel == emission_[last].pixel) {
      add_to(&emission_[last].rgb, emission_[i].rgb);
    } else {
      emission_[++last] = emission_[i];
    }
  }
  if (!emission_.empty()) emission_.resize(last + 1);
}

void PilotValues::add_splats(const std::vector<CellPreview::Splat>& splats) {
  const auto width = static_cast<uint32_t>(grid_.width);
  for (const CellPreview::Splat& splat : splats) {
    if (splat.per_hit * pilot_pixels_.paths_per_pixel() >= kEnoughSplats) {
      emission_.push_back({splat.pixel, splat.rgb});
    } else {
      weights_.add_splat(static_cast<int>(splat.pixel % width), static_cast<int>(splat.pixel / width),
                         splat.rgb);
    }
  }
}

void PilotValues::add_emission(int x, int y, PixelValue* value) const {
  const auto pixel = static_cast<uint32_t>(y) * static_cast<uint32_t>(grid_.width) + static_cast<uint32_t>(x);
  const auto at = std::lower_bound(emission_.begin(), emission_.end(), pixel,
                                   [](const Emission& e, uint32_t p) { return e.pixel < p; });
  if (at == emission_.end() || at->pixel != pixel) return;
  value->emitter_share = static_cast<float>(per_splat_);
  for (size_t ch = 0; ch < 3; ++ch) value->value[ch] += at->rgb[ch] * value->emitter_share;
}

PixelValue PilotValues::of(int x, int y) const {
  PixelValue value = weights_.of(x, y);
  add_emission(x, y, &value);
  return value;
}

std::array<PixelValue, kCellPixels> PilotValues::of_cell(size_t i) const {
  std::array<PixelValue, kCellPixels> values{};
  size_t k = 0;
  for_seen(i, [&](int x, int y) {
    PixelValue& value = values[slot_of(x, y)];
    value = weights_.of(x, y, cells_[i].seen[k++], static_cast<float>(pilot_pixels_.samples));
    add_emission(x, y, &value);
  });
  return values;
}

}  // namespace lightmill
