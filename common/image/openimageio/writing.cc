#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>
#include <optional>

#include "common/image/openimageio/functions.h"

namespace lightmill::openimageio {
namespace {

using Format = ImageToWrite::Format;

OIIO::TypeDesc type_in_file(const ImageToWrite& image) {
  if (image.format == Format::kPng) return OIIO::TypeDesc::UINT8;
  return image.format == Format::kExr && image.half ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT;
}

/// The names of the last channels, and which of all are half.
void describe_layers(const ImageToWrite& image, OIIO::ImageSpec* spec) {
  const size_t own = spec->channelnames.size() - image.layers.size();
  if (image.half) spec->channelformats.assign(spec->channelnames.size(), OIIO::TypeDesc::HALF);
  for (size_t i = 0; i < image.layers.size(); ++i) {
    const ImageToWrite::Layer& layer = image.layers[i];
    spec->channelnames[own + i] = layer.name;
    if (layer.name == "A") spec->alpha_channel = static_cast<int>(own + i);
    if (image.half && layer.whole) spec->channelformats[own + i] = OIIO::TypeDesc::FLOAT;
  }
}

}  // namespace

bool write(const ImageToWrite& image, const std::string& path, std::vector<unsigned char>* memory,
           std::string* why) {
  std::optional<OIIO::Filesystem::IOVecOutput> proxy;
  if (memory) proxy.emplace(*memory);
  const auto out = OIIO::ImageOutput::create(path, proxy ? &*proxy : nullptr);
  if (!out) {
    *why = OIIO::geterror();
    return false;
  }
  OIIO::ImageSpec spec(image.width, image.height, image.channels, type_in_file(image));
  if (image.encoding != ImageToWrite::Encoding::kUnknown) {
    spec.attribute("oiio:ColorSpace", image.encoding == ImageToWrite::Encoding::kLinear ? "Linear" : "sRGB");
  }
  if (image.chromaticities) {
    spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), image.chromaticities->data());
  }
  if (!image.layers.empty()) describe_layers(image, &spec);
  if (image.format == Format::kExr) spec.attribute("compression", "zip");
  for (const auto& [name, text] : image.attributes) spec.attribute(name, text);
  const bool written = out->open(path, spec) &&
                       (image.bytes ? out->write_image(OIIO::TypeDesc::UINT8, image.bytes)
                                    : out->write_image(OIIO::TypeDesc::FLOAT, image.floats)) &&
                       out->close();
  if (!written) *why = out->geterror();
  return written;
}

}  // namespace lightmill::openimageio
