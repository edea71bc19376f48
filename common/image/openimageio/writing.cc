#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>
#include <optional>

#include "common/image/openimageio/functions.h"

namespace lightmill::openimageio {

bool write(const ImageToWrite& image, const std::string& path, std::vector<unsigned char>* memory,
           std::string* why) {
  std::optional<OIIO::Filesystem::IOVecOutput> proxy;
  if (memory) proxy.emplace(*memory);
  const auto out = OIIO::ImageOutput::create(path, proxy ? &*proxy : nullptr);
  if (!out) {
    *why = OIIO::geterror();
    return false;
  }
  OIIO::ImageSpec spec(image.width, image.height, image.channels,
                       image.bytes ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT);
  spec.attribute("oiio:ColorSpace", image.linear ? "Linear" : "sRGB");
  const bool written = out->open(path, spec) &&
                       (image.bytes ? out->write_image(OIIO::TypeDesc::UINT8, image.bytes)
                                    : out->write_image(OIIO::TypeDesc::FLOAT, image.floats)) &&
                       out->close();
  if (!written) *why = out->geterror();
  return written;
}

}  // namespace lightmill::openimageio
