#include "common/image/denoise/blend.h"

#include <algorithm>
#include <cmath>

namespace lightmill::denoise {

namespace {

constexpr int kBlendRadius = 3;      // of the boxes that sums are over
constexpr int kWideRadius = 12;      // and of wider ones,
constexpr float kWideFactor = 0.1f;  // and what their pixels count: they bound the noise of t
constexpr int kNearRadius = 1;

/// Pixels of the box around (x, y), cut at the border.
int pixels_around(const Extent& extent, int x, int y, int radius) {
  const int rows = std::min(y + radius, extent.height - 1) - std::max(y - radius, 0) + 1;
  const int columns = std::min(x + radius, extent.width - 1) - std::max(x - radius, 0) + 1;
  return rows * columns;
}

Plane sums_around(const Extent& extent, const Plane& plane, BlendSums of, int threads) {
  Plane sums(extent.pixels(), 0.0f);
  const auto add = [&](int radius, float factor) {
    Plane means = plane;
    box_mean(extent, radius, threads, &means);
    for_rows(extent, threads, [&](int y) {
      for (int x = 0; x < extent.width; ++x) {
        sums[extent.at(x, y)] +=
            factor * static_cast<float>(pixels_around(extent, x, y, radius)) * means[extent.at(x, y)];
      }
    });
  };
  add(kBlendRadius, 1);
  add(kWideRadius, kWideFactor);
  if (of == BlendSums::kButNear) add(kNearRadius, -(1 + kWideFactor));
  return sums;
}

/// Whether there are pixels around that are not near.
bool has_others(const Extent& extent, int x, int y) {
  return pixels_around(extent, x, y, kBlendRadius) > pixels_around(extent, x, y, kNearRadius);
}

}  // namespace

void blend_in(const Extent& extent, const Halves& halves, const Halves& finer, BlendSums sums, int threads,
              Halves* base) {
  const size_t pixels = extent.pixels();
  Plane product(pixels), square(pixels);
  for_rows(extent, threads, [&](int y) {
    const size_t begin = extent.at(0, y), end = begin + static_cast<size_t>(extent.width);
    for (int c = 0; c < 3; ++c) {
      const Plane &fa = base->of[0].c[c], &fb = base->of[1].c[c], &ga = finer.of[0].c[c],
                  &gb = finer.of[1].c[c];
      const Plane &a = halves.of[0].c[c], &b = halves.of[1].c[c];
      for (size_t i = begin; i < end; ++i) {
        const float mean = 0.5f * (fa[i] + fb[i]), weight = 1 / (mean * mean + kRelativeFloor);
        const float da = ga[i] - fa[i], db = gb[i] - fb[i];
        product[i] += weight * ((b[i] - fa[i]) * da + (a[i] - fb[i]) * db);
        square[i] += weight * (da * da + db * db);
      }
    }
  });
  const Plane up = sums_around(extent, product, sums, threads),
              down = sums_around(extent, square, sums, threads);
  for_rows(extent, threads, [&](int y) {
    const size_t begin = extent.at(0, y), end = begin + static_cast<size_t>(extent.width);
    for (int x = 0; x < extent.width; ++x) {
      const size_t i = extent.at(x, y);
      product[i] = down[i] > 0 ? std::clamp(up[i] / down[i], 0.0f, 1.0f) : 0;
      if (!has_others(extent, x, y)) product[i] = 1;  // nothing says that smoothing pays
    }
    for (int h = 0; h < 2; ++h) {
      for (int c = 0; c < 3; ++c) {
        Plane& f = base->of[h].c[c];
        const Plane& g = finer.of[h].c[c];
        for (size_t i = begin; i < end; ++i) f[i] += product[i] * (g[i] - f[i]);
      }
    }
  });
}

}  // namespace lightmill::denoise
