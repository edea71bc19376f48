#include "common/error/halves_error.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/error/error_weights.h"
#include "common/image/fill_holes.h"

namespace lightmill {

namespace {

constexpr float kLargest = 1e15f;  // squares of the values have to be floats
// One difference says little of a pixel's noise, so more pixels around are asked than batches need.
constexpr PixelReach kReach{4, 4};

}  // namespace

double relmse_of_halves(const Image& image, const Image& difference) {
  if (image.channels != 3 || difference.data.size() != image.data.size() || image.data.empty())
    throw std::invalid_argument("relmse_of_halves: not a picture and its difference");
  std::vector<uint8_t> known(image.data.size() / 3, 1);
  for (size_t i = 0; i < image.data.size(); ++i)
    known[i / 3] &= static_cast<uint8_t>(std::isfinite(image.data[i]) && std::isfinite(difference.data[i]));
  Image mean(image.width, image.height);
  std::vector<float> variance(image.data.size());
  for (size_t i = 0; i < image.data.size(); ++i) {
    if (!known[i / 3]) continue;
    mean.data[i] = std::clamp(image.data[i], -kLargest, kLargest);
    const float d = std::clamp(difference.data[i], -kLargest, kLargest);
    variance[i] = d * d;
  }
  // Pixels without a number must not darken their neighbours' denominators.
  fill_holes(known, &mean);
  const PixelLayout layout{static_cast<size_t>(image.width), static_cast<size_t>(image.height)};
  Neighbourhood around;
  neighbourhood(mean.data, variance, layout, kReach, &around);
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < image.data.size(); ++i) {
    if (!known[i / 3]) continue;
    const double t = variance[i];
    // The weight must not follow the pixel's own t, which it is multiplied by, but for how far the pixel is
    // to be trusted: a firefly would hide behind its own brightness.
    const Fraction own = corrected_weight(mean.data[i], around.noise[i], 1);
    sum += t * blend_with_around(own, std::max(t, double{around.noise[i]}), around.square[i]);
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

}  // namespace lightmill
