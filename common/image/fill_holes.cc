#include "common/image/fill_holes.h"

#include <algorithm>

namespace lightmill {
namespace {

/// Means of what is known below each pixel, and how much of it is: a weight in [0, 1].
struct Level {
  Image mean;
  std::vector<float> weight;
};

/// The next coarser level: each pixel is the weighted mean of four.
Level pull(const Level& fine) {
  const int width = (fine.mean.width + 1) / 2, height = (fine.mean.height + 1) / 2,
            channels = fine.mean.channels;
  Level coarse{Image(width, height, channels),
               std::vector<float>(static_cast<size_t>(width) * static_cast<size_t>(height))};
  for (int y = 0; y < fine.mean.height; ++y) {
    for (int x = 0; x < fine.mean.width; ++x) {
      const float w =
          fine.weight[static_cast<size_t>(y) * static_cast<size_t>(fine.mean.width) + static_cast<size_t>(x)];
      const float* from = fine.mean.pixel(x, y);
      float* to = coarse.mean.pixel(x / 2, y / 2);
      for (int c = 0; c < channels; ++c) to[c] += w * from[c];
      coarse.weight[static_cast<size_t>(y / 2) * static_cast<size_t>(width) + static_cast<size_t>(x / 2)] +=
          w;
    }
  }
  for (size_t i = 0; i < coarse.weight.size(); ++i) {
    float& w = coarse.weight[i];
    const float scale = w > 0 ? 1 / w : 0;
    for (int c = 0; c < channels; ++c)
      coarse.mean.data[i * static_cast<size_t>(channels) + static_cast<size_t>(c)] *= scale;
    w = std::min(w, 1.0f);
  }
  return coarse;
}

/// Blends the coarser level into what is known in part only, interpolated between its four nearest pixels.
void push(const Level& coarse, Level* fine) {
  const int channels = fine->mean.channels;
  const auto neighbour = [](int at, int size) { return std::clamp(at / 2 + (at % 2 ? 1 : -1), 0, size - 1); };
  for (int y = 0; y < fine->mean.height; ++y) {
    const int y0 = y / 2, y1 = neighbour(y, coarse.mean.height);
    for (int x = 0; x < fine->mean.width; ++x) {
      const float w = fine->weight[static_cast<size_t>(y) * static_cast<size_t>(fine->mean.width) +
                                   static_cast<size_t>(x)];
      if (w >= 1) continue;
      const int x0 = x / 2, x1 = neighbour(x, coarse.mean.width);
      const float* corner[4] = {coarse.mean.pixel(x0, y0), coarse.mean.pixel(x1, y0),
                                coarse.mean.pixel(x0, y1), coarse.mean.pixel(x1, y1)};
      float* to = fine->mean.pixel(x, y);
      for (int c = 0; c < channels; ++c) {
        const float around =
            (9 * corner[0][c] + 3 * corner[1][c] + 3 * corner[2][c] + corner[3][c]) * (1.0f / 16);
        to[c] = w * to[c] + (1 - w) * around;
      }
    }
  }
}

}  // namespace

void fill_holes(const std::vector<uint8_t>& known, Image* image) {
  if (std::find(known.begin(), known.end(), 0) == known.end()) return;
  if (std::find(known.begin(), known.end(), 1) == known.end()) return;
  std::vector<Level> levels(1);
  levels[0].mean = std::move(*image);
  for (const uint8_t k : known) levels[0].weight.push_back(k ? 1.0f : 0.0f);
  while (levels.back().mean.width > 1 || levels.back().mean.height > 1) levels.push_back(pull(levels.back()));
  for (size_t i = levels.size() - 1; i > 0; --i) push(levels[i], &levels[i - 1]);
  *image = std::move(levels[0].mean);
}

}  // namespace lightmill
