// What image.h says of reading.
#include <filesystem>

#include "common/base/error.h"
#include "common/image/color_channels.h"
#include "common/image/cryptomatte/matte_attributes.h"
#include "common/image/image.h"
#include "common/image/image_reader.h"
#include "common/image/library_message.h"
#include "common/job/settings.h"

namespace lightmill {

namespace {

[[noreturn]] void cannot_read(const std::string& path, const std::string& why) {
  throw Error(ErrorKind::kFailed, path + ": can't read the image: " + library_message(why));
}

ImageReader open_image(const std::string& path) {
  std::error_code ec;
  if (!std::filesystem::exists(path, ec)) cannot_read(path, "no such file");
  if (std::filesystem::is_directory(path, ec)) cannot_read(path, "it is a folder");
  std::string why;
  auto in = ImageReader::open({path}, &why);
  if (!in) cannot_read(path, why);
  return std::move(*in);
}

RgbPrimaries said_primaries(const ImageHeader& file) {
  if (!file.chromaticities) return kRec709Primaries;
  const auto& xy = *file.chromaticities;
  const auto point = [&](size_t i) { return RgbPrimaries::Point{double{xy[2 * i]}, double{xy[2 * i + 1]}}; };
  return {point(0), point(1), point(2), point(3)};
}

/// Nothing where no conversion is needed.
std::optional<RgbMatrix> to_rec709_of(const ImageHeader& file, const std::string& path) {
  const RgbPrimaries said = said_primaries(file);
  if (are_same(said, kRec709Primaries)) return std::nullopt;
  const auto matrix = rgb_conversion(said, kRec709Primaries);
  if (!matrix) {
    cannot_read(
        path, "its chromaticities are those of no colours; correct this attribute of the file, or remove it");
  }
  return matrix;
}

}  // namespace

Image read_image(const std::string& path) {
  const ImageReader in = open_image(path);
  const ImageHeader& file = in.header();
  if (file.width < 1 || file.height < 1 || file.depth > 1 || file.channels < 1 ||
      file.width > kMaxResolution || file.height > kMaxResolution ||
      int64_t{file.width} * file.height > kMaxPixels) {
    cannot_read(path, "its size is out of range (at most " + std::to_string(kMaxPixels) + " pixels)");
  }
  const auto to_rec709 = to_rec709_of(file, path);
  const int used = file.channels >= 3 ? 3 : 1;
  Image raw(file.width, file.height, used);
  std::string why;
  if (!in.read(0, used, raw.data.data(), &why)) cannot_read(path, why);
  // Integer files hold sRGB values unless they say otherwise; floats are linear.
  if (!file.is_floating_point && !file.says_linear) {
    for (float& v : raw.data) v = srgb_to_linear(v);
  }
  if (used == 3) {
    for (size_t i = 0; to_rec709 && i < raw.data.size(); i += 3) convert_color(*to_rec709, &raw.data[i]);
    return raw;
  }
  Image image(file.width, file.height, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = raw.data[i / 3];
  return image;
}

ChannelImage read_channels(const std::string& path, int64_t max_pixels) {
  const ImageReader in = open_image(path);
  const ImageHeader& file = in.header();
  if (file.width < 1 || file.height < 1 || file.depth > 1 || file.channels < 1) {
    cannot_read(path, "it has no pixels");
  }
  if (!file.is_floating_point) cannot_read(path, "it does not hold floats");
  if (int64_t{file.width} * file.height > max_pixels) {
    throw Error(ErrorKind::kUsage, path + ": it has " + std::to_string(file.width) + "x" +
                                       std::to_string(file.height) + " pixels; at most " +
                                       std::to_string(max_pixels) + " can be taken");
  }
  const auto to_rec709 = to_rec709_of(file, path);
  ChannelImage result;
  result.image = Image(file.width, file.height, file.channels);
  result.channels = in.channel_names();
  std::string why;
  if (!in.read(0, file.channels, result.image.data.data(), &why)) cannot_read(path, why);
  result.attributes = matte_attributes(in, result.channels);
  if (to_rec709) convert_colors(&result, *to_rec709);
  return result;
}

std::optional<ImageSpace> read_image_space(const std::string& path) {
  return image_space_of(said_primaries(open_image(path).header()));
}

std::string read_image_metadata(const std::string& path, const std::string& key) {
  return open_image(path).attribute("lightmill:" + key);
}

}  // namespace lightmill
