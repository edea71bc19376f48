// lightmill-images.so: the table of its functions, and which build and library they are of.
#include <OpenImageIO/imageio.h>

#include "common/build_id/build_id.h"
#include "common/image/openimageio/functions.h"

namespace lightmill::openimageio {
namespace {

/// "2.4.7" of 20407.
std::string version_text(int version) {
  return std::to_string(version / 10000) + '.' + std::to_string(version / 100 % 100) + '.' +
         std::to_string(version % 100);
}

}  // namespace
}  // namespace lightmill::openimageio

/// All that the module shows. Its name and the head of what it returns are the same in every build.
extern "C" [[gnu::visibility("default")]] const lightmill::ImageLibrary* lightmill_images() {
  using namespace lightmill;
  static const std::string build = build_id();
  static const std::string built = openimageio::version_text(OIIO_VERSION);
  static const std::string running = openimageio::version_text(OIIO::openimageio_version());
  static const ImageLibrary library{
      build.c_str(),
      built.c_str(),
      running.c_str(),
      openimageio::open,
      openimageio::close,
      openimageio::read,
      openimageio::attribute,
      openimageio::channel_names,
      openimageio::write,
      openimageio::make_tiles,
      openimageio::free_tiles,
      openimageio::open_tiled,
      openimageio::tiled_path,
      openimageio::read_tiled,
      openimageio::open_color_config,
      openimageio::close_color_config,
      openimageio::make_conversion,
      openimageio::make_view,
      openimageio::free_color_transform,
      openimageio::apply_color_transform,
  };
  return &library;
}
