#pragma once
// Planes of floats that the denoiser's steps hand on, and sums over boxes of them.
#include <cstddef>
#include <vector>

namespace lightmill::denoise {

/// One value a pixel, row-major.
using Plane = std::vector<float>;

/// Size of all planes of a picture.
struct Extent {
  int width = 0, height = 0;
  size_t pixels() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
};

/// RGB, one plane a channel.
struct Colour {
  Plane c[3];
  Colour() = default;
  explicit Colour(size_t pixels) : c{Plane(pixels), Plane(pixels), Plane(pixels)} {}
};

/// Two pictures of the same scene whose errors are independent and of equal variance; their mean is the
/// picture. What is done to one is done to the other, from its own values as far as possible, so that each
/// can be measured against the other.
struct Halves {
  Colour of[2];
  Halves() = default;
  explicit Halves(size_t pixels) : of{Colour(pixels), Colour(pixels)} {}
};

/// Rows that a thread takes at a time.
inline constexpr int kRowsTogether = 16;

/// Calls work(y) for all rows, on up to `threads` threads.
void for_rows(const Extent& extent, int threads, const auto& work);

/// The means over the boxes of pixels at most `radius` away on both axes, cut at the border; in place. Each
/// row and column is summed in one order, so the bits do not depend on the threads.
void box_mean(const Extent& extent, int radius, int threads, Plane* plane);

/// The largest value in the same boxes.
Plane box_max(const Extent& extent, int radius, int threads, const Plane& plane);

}  // namespace lightmill::denoise

#include "common/base/parallel.h"

namespace lightmill::denoise {

void for_rows(const Extent& extent, int threads, const auto& work) {
  const auto bands = static_cast<size_t>((extent.height + kRowsTogether - 1) / kRowsTogether);
  parallel_for(bands, threads, [&](size_t band) {
    const int begin = static_cast<int>(band) * kRowsTogether;
    for (int y = begin; y < std::min(begin + kRowsTogether, extent.height); ++y) work(y);
  });
}

}  // namespace lightmill::denoise
