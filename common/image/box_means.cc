#include "common/image/box_means.h"

#include <algorithm>

namespace lightmill {

Image box_means(const Image& image, int side) {
  Image means(image.width / side, image.height / side, image.channels);
  if (means.data.empty()) return means;
  const auto channels = static_cast<size_t>(image.channels);
  std::vector<double> sums(static_cast<size_t>(means.width) * channels);  // of one row of boxes
  const double pixels = static_cast<double>(side) * side;
  for (int row = 0; row < means.height; ++row) {
    std::fill(sums.begin(), sums.end(), 0.0);
    for (int y = row * side; y < (row + 1) * side; ++y) {
      const float* value = image.pixel(0, y);
      for (size_t box = 0; box < sums.size(); box += channels) {
        for (int x = 0; x < side; ++x) {
          for (size_t c = 0; c < channels; ++c) sums[box + c] += static_cast<double>(*value++);
        }
      }
    }
    float* mean = means.pixel(0, row);
    for (const double sum : sums) *mean++ = static_cast<float>(sum / pixels);
  }
  return means;
}

}  // namespace lightmill
