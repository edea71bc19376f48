#include "common/image/denoise/fireflies.h"

#include <algorithm>

namespace lightmill::denoise {

namespace {

constexpr int kFireflyRadius = 2;
constexpr float kAbove = 1.5f;

}  // namespace

void clamp_fireflies(const Extent& extent, int threads, Halves* halves) {
  Plane brightness[2], brightest[2];
  for (int h = 0; h < 2; ++h) {
    const Colour& colour = halves->of[h];
    brightness[h].resize(extent.pixels());
    for (size_t i = 0; i < extent.pixels(); ++i) {
      brightness[h][i] = std::max({colour.c[0][i], colour.c[1][i], colour.c[2][i]});
    }
    brightest[h] = box_max(extent, kFireflyRadius, threads, brightness[h]);
  }
  for (int h = 0; h < 2; ++h) {
    for (size_t i = 0; i < extent.pixels(); ++i) {
      const float limit = kAbove * std::max(brightest[1 - h][i], 0.0f);
      if (!(brightness[h][i] > limit)) continue;
      const float scale = limit / brightness[h][i];
      for (Plane& plane : halves->of[h].c) plane[i] *= scale;
    }
  }
}

}  // namespace lightmill::denoise
