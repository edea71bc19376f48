#include "common/image/denoise/noise.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "common/base/split_mix.h"

namespace lightmill::denoise {

namespace {

constexpr int kNoiseRadius = 3;

/// A standard normal number of a pixel (Box and Muller).
float normal_number(uint64_t pixel, unsigned stream) {
  const uint64_t bits = split_mix(pixel * 4 + stream);
  const double u = (static_cast<double>(bits >> 32) + 0.5) * 0x1p-32;
  const double v = static_cast<double>(bits & 0xffffffffu) * 0x1p-32;
  return static_cast<float>(std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v));
}

}  // namespace

Plane guess_difference(const Extent& extent, const Plane& channel, unsigned stream, int threads) {
  Plane variance(extent.pixels());
  for_rows(extent, threads, [&](int y) {
    const auto at = [&](int x, int v) {
      return channel[extent.at(std::clamp(x, 0, extent.width - 1), std::clamp(v, 0, extent.height - 1))];
    };
    for (int x = 0; x < extent.width; ++x) {
      const float corners = at(x - 1, y - 1) + at(x + 1, y - 1) + at(x - 1, y + 1) + at(x + 1, y + 1);
      const float sides = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1);
      const float d = corners - 2 * sides + 4 * at(x, y);
      variance[extent.at(x, y)] = d * d * (1.0f / 36);
    }
  });
  box_mean(extent, kNoiseRadius, threads, &variance);
  for_rows(extent, threads, [&](int y) {
    for (int x = 0; x < extent.width; ++x) {
      float& value = variance[extent.at(x, y)];
      const uint64_t pixel = (static_cast<uint64_t>(y) << 32) + static_cast<uint64_t>(x);
      value = std::sqrt(value) * normal_number(pixel, stream);
    }
  });
  return variance;
}

}  // namespace lightmill::denoise
