#include "coordinator/store/image_bytes.h"

#include <cstdint>
#include <cstring>

#include "common/job/settings.h"

namespace lightmill {

std::string image_to_bytes(const Image& image) {
  const int32_t size[2] = {image.width, image.height};
  std::string bytes(reinterpret_cast<const char*>(size), sizeof size);
  bytes.append(reinterpret_cast<const char*>(image.data.data()), image.data.size() * sizeof(float));
  return bytes;
}

Image image_from_bytes(const std::string& bytes) {
  int32_t size[2];
  if (bytes.size() < sizeof size) return {};
  std::memcpy(size, bytes.data(), sizeof size);
  if (size[0] <= 0 || size[1] <= 0 || int64_t{size[0]} * size[1] > kMaxPixels) return {};
  Image image(size[0], size[1]);
  if (bytes.size() != sizeof size + image.data.size() * sizeof(float)) return {};
  std::memcpy(image.data.data(), bytes.data() + sizeof size, image.data.size() * sizeof(float));
  return image;
}

}  // namespace lightmill
