#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>

#include "common/image/openimageio/functions.h"

namespace lightmill {

struct OpenImageFile {
  std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;  // which `in` may read from
  std::unique_ptr<OIIO::ImageInput> in;
};

namespace openimageio {
namespace {

std::optional<std::array<float, 8>> chromaticities_of(const OIIO::ImageSpec& spec) {
  std::array<float, 8> xy{};
  if (!spec.getattribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), xy.data()))
    return std::nullopt;
  return xy;
}

}  // namespace

OpenImageFile* open(const ImageSource& source, ImageHeader* header, std::string* why) {
  auto file = std::make_unique<OpenImageFile>();
  if (source.contents) {
    file->memory =
        std::make_unique<OIIO::Filesystem::IOMemReader>(const_cast<void*>(source.contents), source.bytes);
  }
  OIIO::ImageSpec wishes;
  if (source.as_stored) wishes.attribute("oiio:UnassociatedAlpha", 1);
  // Readers take what they read from of the configuration, once there is one.
  OIIO::Filesystem::IOProxy* proxy = file->memory.get();
  if (proxy) wishes.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  file->in = OIIO::ImageInput::open(source.path, source.as_stored || proxy ? &wishes : nullptr, proxy);
  if (!file->in) {
    *why = OIIO::geterror();
    return nullptr;
  }
  const OIIO::ImageSpec& spec = file->in->spec();
  *header = {spec.width,
             spec.height,
             spec.depth,
             spec.nchannels,
             spec.format == OIIO::TypeDesc::UINT8,
             spec.format.is_floating_point(),
             spec.get_string_attribute("oiio:ColorSpace") == "Linear",
             chromaticities_of(spec)};
  return file.release();
}

void close(OpenImageFile* file) { delete file; }

bool read(OpenImageFile& file, int begin, int end, TexelType type, void* out, std::string* why) {
  if (file.in->read_image(0, 0, begin, end, type_of(type), out)) return true;
  *why = file.in->geterror();
  return false;
}

std::string attribute(const OpenImageFile& file, const std::string& name) {
  return std::string(file.in->spec().get_string_attribute(name));
}

std::vector<std::string> channel_names(const OpenImageFile& file) { return file.in->spec().channelnames; }

}  // namespace openimageio
}  // namespace lightmill
