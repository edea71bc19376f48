// Textures in WebP, as a worker opens and decodes them.
#include <cstdlib>

#include "common/base/error.h"
#include "worker/render/scene/textures/webp_image.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  constexpr int kMostPixels =
      1 << 20;  // a header alone can ask for a gigabyte, which would be slow, not wrong
  ImageTexture texture;
  texture.path = "image.webp";
  texture.contents = std::make_shared<const std::string>(reinterpret_cast<const char*>(data), size);
  try {
    const auto image = open_webp(texture);
    if (!image || image->width < 1 || image->height < 1) abort();
    if (image->width > kMostPixels / image->height) return 0;
    const auto pixels = image->pixels();
    const size_t whole = static_cast<size_t>(image->width) * static_cast<size_t>(image->height) *
                         static_cast<size_t>(image->channels);
    if (!pixels.empty() && pixels.size() != whole) abort();
  } catch (const Error&) {
  }
  return 0;
}
