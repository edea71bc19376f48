#include "common/film/partial_check.h"

#include <cmath>

#include "common/base/error.h"
#include "common/film/crop_walk.h"
#include "common/film/signed_sum.h"
#include "common/job/sample_allocation.h"
#include "common/job/settings.h"

namespace lightmill {

namespace {

constexpr int kMinQuantum = -300, kMaxQuantum = 200;  // beyond any float's scale
constexpr int kMaxCounterBits = 56;                   // a counter that a tile could reach

/// More than any count of floats adds up to.
constexpr double kMaxAmount = 1e60;

void check_dropped(const Partial& p) {
  for (const Dropped::Kind& kind : p.dropped.kinds) {
    if (kind.count >> kMaxCounterBits) refuse_partial("count of what was dropped out of range");
    if (!(kind.amount >= 0 && kind.amount <= kMaxAmount) || (kind.count == 0 && kind.amount != 0))
      refuse_partial("amount of what was dropped out of range");
  }
  if (p.dropped.any() && p.dropped.refused() != p.counters.nonfinite)
    refuse_partial("the kinds of what was dropped do not add up");
}

/// Cryptomatte's counts: that they are there if they are asked for, and no more than the samples.
void check_counts(const Partial& p) {
  if ((p.aovs.spec.set & kAovsOfCounts) == 0) {
    if (!p.mattes.cells.empty() || !p.mattes.names.empty())
      refuse_partial("counts for Cryptomatte that nobody asked for");
    return;
  }
  check_mattes(p.mattes, p.grid, p.tile.cells);
  const size_t ids = p.aovs.spec.set & kAovsOfIds ? p.mattes.names.size() : 0;
  if (p.mattes.ids.size() != ids) refuse_partial("numbers of things that nobody asked for, or none");
  const PixelRect r = p.grid.pixels(p.tile.cells);
  const std::vector<ExactRgb>& weights = p.aovs.layers[kWeightsLayer];
  const auto samples = static_cast<uint64_t>(p.tile.samples());
  size_t pixel = 0;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x, ++pixel) {
      const CellRect& cells = p.tile.cells;
      const int cell = (y / kCellSize - cells.y0) * cells.width() + x / kCellSize - cells.x0;
      const int in_cell = y % kCellSize * kCellSize + x % kCellSize;
      const uint64_t most = weights.empty() ? samples : static_cast<uint64_t>(weights[pixel].c[0]);
      uint64_t left = most;
      for (const MatteCount& entry :
           p.mattes.cells[static_cast<size_t>(cell)].of(static_cast<size_t>(in_cell))) {
        if (entry.count > left) refuse_partial("more hits for Cryptomatte than samples");
        left -= entry.count;
      }
    }
  }
}

}  // namespace

void refuse_partial(const std::string& reason) {
  throw Error(ErrorKind::kFailed, "partial is invalid: " + reason);
}

void check_partial_head(const Partial& p) {
  const FilmGrid& g = p.grid;
  if (g.width < 1 || g.height < 1 || g.width > kMaxResolution || g.height > kMaxResolution ||
      int64_t{g.width} * g.height > kMaxPixels) {
    refuse_partial("resolution out of range");
  }
  if (g.crop.empty() || g.crop.x0 < 0 || g.crop.y0 < 0 || g.crop.x1 > g.width || g.crop.y1 > g.height) {
    refuse_partial("crop window outside the film");
  }
  const CellRect all = g.cells();
  const CellRect& cells = p.tile.cells;
  if (cells.x0 < all.x0 || cells.y0 < all.y0 || cells.x1 > all.x1 || cells.y1 > all.y1 ||
      cells.x1 <= cells.x0 || cells.y1 <= cells.y0) {
    refuse_partial("tile outside the crop window");
  }
  if (p.tile.sample_begin < 0 || p.tile.sample_end > kMaxSampleIndex ||
      p.tile.sample_begin >= p.tile.sample_end || p.tile.samples() > kMaxTileSamples) {
    refuse_partial("sample range out of range");
  }
  if (p.quantum_exponent < kMinQuantum || p.quantum_exponent > kMaxQuantum)
    refuse_partial("quantum out of range");
  const auto pixel_samples =
      static_cast<uint64_t>(g.pixels(cells).area()) * static_cast<uint64_t>(p.tile.samples());
  const RenderCounters& c = p.counters;
  const uint64_t light_paths = kMaxLightPathsPerSample * pixel_samples;
  if (p.light_paths > light_paths || c.light_paths > light_paths ||
      c.camera_paths > kMaxSamplesPerIndex * pixel_samples) {
    refuse_partial("more paths than the tile has samples");
  }
  for (const uint64_t n : {c.closest_hit_rays, c.shadow_rays, c.zero_connections_skipped,
                           c.rouletted_connections, c.nonfinite}) {
    if (n >> kMaxCounterBits) refuse_partial("counter out of range");
  }
  check_dropped(p);
  if (!(p.cpu_seconds >= 0) || !std::isfinite(p.cpu_seconds)) refuse_partial("cpu_seconds is not a duration");
}

LayerUnits check_partial_layers(const Partial& p) {
  LayerUnits any;
  const auto area = static_cast<size_t>(p.grid.pixels(p.tile.cells).area());
  if (!p.camera.empty() && p.camera.size() != area)
    refuse_partial("camera layer of another size than the tile");
  // A sample adds less than 2^kMaxContributionBits.
  const Units limit = static_cast<Units>(kMaxSamplesPerIndex * p.tile.samples()) << kMaxContributionBits;
  for (const ExactRgb& sum : p.camera) {
    for (const Units u : sum.c) {
      any.camera |= u;
      if (magnitude(u) > limit) refuse_partial("camera sum out of range");
    }
  }
  if (!p.splats.empty() && p.light_paths == 0) refuse_partial("splats without light paths");
  CropWalk crop_index(p.grid);
  int64_t last = -1;
  for (const Partial::SplatSum& splat : p.splats) {
    if (int64_t{splat.pixel} <= last) refuse_partial("splats are not in ascending order");
    last = splat.pixel;
    if (crop_index(splat.pixel) < 0) refuse_partial("splat outside the crop window");
    if (splat.sum.is_zero()) refuse_partial("splat of zero");
    for (const Units u : splat.sum.c) {
      any.splats |= u;
      if (magnitude(u) >> kMaxSumBits) refuse_partial("splat sum out of range");
    }
  }
  check_aovs(p.aovs, p.grid, area, p.tile.samples(), p.camera, p.splats);
  check_counts(p);
  return any;
}

}  // namespace lightmill
