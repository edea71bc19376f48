#include "common/rpc/pictures.h"

#include <bit>
#include <cstring>

#include "common/base/error.h"

namespace lightmill {

static_assert(std::endian::native == std::endian::little);

void set_picture(const Image& picture, v1::ShowPictureRequest* message) {
  message->set_width(picture.width);
  message->set_height(picture.height);
  message->set_rgb(picture.data.data(), picture.data.size() * sizeof(float));
}

Image picture_of(const v1::ShowPictureRequest& message) {
  const int64_t width = message.width(), height = message.height();
  const auto bytes = static_cast<int64_t>(message.rgb().size());
  // Not as a product of three, which could overflow.
  if (width < 1 || height < 1 || bytes % 12 != 0 || width * height != bytes / 12)
    throw Error(ErrorKind::kUsage, "a picture has three floats of 32 bits a pixel");
  Image picture(message.width(), message.height());
  std::memcpy(picture.data.data(), message.rgb().data(), message.rgb().size());
  return picture;
}

}  // namespace lightmill
