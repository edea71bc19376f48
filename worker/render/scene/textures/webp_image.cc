#include "worker/render/scene/textures/webp_image.h"

#include <webp/decode.h>

#include "common/base/error.h"
#include "common/scene/scene_files.h"

namespace lightmill {
namespace {

constexpr size_t kMaxFileBytes = size_t{1} << 32;

const uint8_t* bytes_of(const std::string& file) { return reinterpret_cast<const uint8_t*>(file.data()); }

}  // namespace

bool is_webp(const ImageTexture& texture) { return texture.path.ends_with(".webp"); }

std::optional<WebpImage> open_webp(const ImageTexture& texture) {
  if (!is_webp(texture)) return std::nullopt;
  WebpImage image;
  WebPBitstreamFeatures features;
  try {
    image.file = texture.contents
                     ? texture.contents
                     : std::make_shared<const std::string>(read_scene_file(texture.path, kMaxFileBytes));
  } catch (const Error& e) {
    throw Error(ErrorKind::kBadScene, texture.path + ": texture can't be read: " + e.what());
  }
  if (WebPGetFeatures(bytes_of(*image.file), image.file->size(), &features) != VP8_STATUS_OK)
    throw Error(ErrorKind::kBadScene, texture.path + ": texture can't be read: it is no WebP image");
  if (features.has_animation)
    throw Error(ErrorKind::kBadScene,
                texture.path + ": texture can't be read: it is animated; save one frame");
  image.width = features.width;
  image.height = features.height;
  image.channels = features.has_alpha ? 4 : 3;
  return image;
}

std::vector<uint8_t> WebpImage::pixels() const {
  const size_t row = static_cast<size_t>(width) * static_cast<size_t>(channels);
  std::vector<uint8_t> out(row * static_cast<size_t>(height));
  const auto decode = channels == 4 ? WebPDecodeRGBAInto : WebPDecodeRGBInto;
  if (!decode(bytes_of(*file), file->size(), out.data(), out.size(), static_cast<int>(row))) out.clear();
  return out;
}

}  // namespace lightmill
