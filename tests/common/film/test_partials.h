#pragma once
// Small random partials for the tests of the image library.
#include <random>

#include "common/film/partial.h"
#include "common/job/pixel_interleave.h"

namespace lightmill::testing {

inline constexpr int kQuantum = -52;

inline FilmGrid full_grid(int width, int height) { return {width, height, {0, 0, width, height}}; }

inline ExactRgb random_sum(std::mt19937_64& rng, int bits = 60) {
  const uint64_t mask = (uint64_t{1} << bits) - 1;
  return {{rng() & mask, rng() & mask, rng() & mask}};
}

/// Sums of the crop window in packet order, from those in film order.
inline std::vector<ExactRgb> in_packet_order(const FilmGrid& grid, const std::vector<ExactRgb>& film_order) {
  const PixelInterleave interleave(grid);
  const PixelRect& crop = grid.crop;
  std::vector<ExactRgb> sums;
  for (int y = crop.y0; y < crop.y1; ++y) {
    for (int x = crop.x0; x < crop.x1; ++x)
      sums.push_back(film_order[static_cast<size_t>(interleave.film_index(x, y))]);
  }
  return sums;
}

/// Batch number `b` of 16 samples of the whole crop window: an image of b + 1 in the first channel.
inline Partial constant_batch(const FilmGrid& grid, int64_t b) {
  Partial p;
  p.grid = grid;
  p.quantum_exponent = kQuantum;
  p.tile = {grid.cells(), 16 * b, 16 * b + 16};
  p.camera.assign(static_cast<size_t>(grid.crop.area()),
                  ExactRgb{{*to_units(16.0f * static_cast<float>(b + 1), kQuantum), 0, 0}});
  return p;
}

/// A valid partial of `tile` with about one splat in `splat_every` pixels (0: none).
inline Partial random_partial(const FilmGrid& grid, const TileSpec& tile, uint64_t seed, bool camera,
                              uint64_t splat_every) {
  std::mt19937_64 rng(seed);
  Partial p;
  p.grid = grid;
  p.tile = tile;
  p.quantum_exponent = kQuantum;
  const int64_t samples = grid.pixels(tile.cells).area() * tile.samples();
  if (camera) {
    p.camera.resize(static_cast<size_t>(grid.pixels(tile.cells).area()));
    for (ExactRgb& sum : p.camera) sum = random_sum(rng);
    p.counters.camera_paths = static_cast<uint64_t>(samples);
  }
  if (splat_every > 0) {
    for (int y = grid.crop.y0; y < grid.crop.y1; ++y) {
      for (int x = grid.crop.x0; x < grid.crop.x1; ++x) {
        if (rng() % splat_every != 0) continue;
        ExactRgb sum = random_sum(rng);
        sum.c[0] |= 1;  // never zero
        p.splats.push_back({static_cast<uint32_t>(y * grid.width + x), sum});
      }
    }
    p.light_paths = p.counters.light_paths = static_cast<uint64_t>(samples);
  }
  p.counters.shadow_rays = rng() % 1000;
  p.counters.closest_hit_rays = rng() % 1000;
  p.cpu_seconds = 0.125 * static_cast<double>(seed % 8);
  return p;
}

}  // namespace lightmill::testing
