#include "tests/bench/farm/simulated_partial.h"

#include <cmath>

namespace lightmill {
namespace {

// As measured on scenes/cornell-spheres.pbrt: the part of the window's pixels that splats can reach, how fast
// they do, 1 - exp(-kReachRate samples per pixel), and the bits of their sums.
constexpr double kReached = 0.86, kReachRate = 1.6;
constexpr int kSplatBits = 30;

}  // namespace

SimulatedPartial::SimulatedPartial(const RenderSettings& settings)
    : grid_(settings.grid), splats_(has_splat_layer(settings)) {
  partial_.grid = grid_;
  partial_.quantum_exponent = -40;
}

void SimulatedPartial::add_splats(const TileSpec& tile) {
  const auto window = static_cast<uint32_t>(grid_.crop.area());
  const double samples = static_cast<double>(grid_.pixels(tile.cells).area() * tile.samples());
  const double reached = kReached * (1 - std::exp(-kReachRate * samples / window));
  const auto bits = [&] { return static_cast<Units>(random_() >> (64 - kSplatBits)); };
  partial_.splats.clear();
  for (uint32_t pixel = 0; pixel < window; ++pixel) {
    if (std::uniform_real_distribution<double>(0, 1)(random_) >= reached) continue;
    partial_.splats.push_back({pixel, {{bits() + 1, bits(), bits()}}});
  }
  partial_.light_paths = partial_.counters.light_paths = static_cast<uint64_t>(samples);
}

std::string SimulatedPartial::encode(const TileSpec& tile, double cpu_seconds) {
  const auto area = static_cast<size_t>(grid_.pixels(tile.cells).area());
  if (partial_.camera.size() != area || partial_.tile.samples() != tile.samples()) {
    partial_.camera.resize(area);
    for (size_t i = 0; i < area; ++i) {
      // Low bits as random as those of a real image, so that compression has as much to do.
      for (int c = 0; c < 3; ++c) {
        partial_.camera[i].c[c] = (static_cast<Units>(tile.samples()) << 38) +
                                  ((i * 3 + static_cast<size_t>(c) + 1) * 0x9e3779b97f4a7c15u >> 28);
      }
    }
  }
  partial_.tile = tile;
  partial_.counters.camera_paths = area * static_cast<uint64_t>(tile.samples());
  partial_.cpu_seconds = cpu_seconds;
  if (splats_) add_splats(tile);
  return encode_partial(partial_);
}

}  // namespace lightmill
