#include "common/image/enlarge.h"

#include <algorithm>
#include <cstdint>

namespace lightmill {

Image enlarged(const Image& from, int width, int height) {
  Image to(width, height);
  for (int y = 0; y < height; ++y) {
    const auto row = static_cast<int>(int64_t{y} * from.height / height);
    for (int x = 0; x < width; ++x)
      std::copy_n(from.pixel(static_cast<int>(int64_t{x} * from.width / width), row), 3, to.pixel(x, y));
  }
  return to;
}

}  // namespace lightmill
