#pragma once
// WebP images as they are stored. OpenImageIO multiplies their colours by alpha, which is wrong for a masked
// texture.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/description.h"

namespace lightmill {

struct WebpImage {
  std::shared_ptr<const std::string> file;
  int width, height, channels;  // 3 or 4

  /// width * height * channels bytes, rows from the top. Empty if the file is damaged.
  std::vector<uint8_t> pixels() const;
};
/// Opens a WebP image. Nothing if the texture is not WebP, by its contents or else its name. Throws
/// Error(kBadScene) if its header can't be read.
std::optional<WebpImage> open_webp(const ImageTexture& texture);
bool is_webp(const ImageTexture& texture);

}  // namespace lightmill
