#include "common/image/image.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "common/base/error.h"
#include "common/base/lower_case.h"
#include "common/image/color_channels.h"
#include "common/image/image_library.h"
#include "common/image/library_message.h"
#include "common/image/pfm_file.h"
#include "common/job/aovs.h"

namespace lightmill {

namespace {

namespace fs = std::filesystem;

enum class Format { kExr, kPng, kHdr, kPfm };

Format format_of(const std::string& path) {
  const std::string extension = lower_case(fs::path(path).extension().string());
  if (extension == ".exr") return Format::kExr;
  if (extension == ".png") return Format::kPng;
  if (extension == ".hdr") return Format::kHdr;
  if (extension == ".pfm") return Format::kPfm;
  throw Error(ErrorKind::kUsage, path + ": unknown image format \"" + extension +
                                     "\"; name the output .exr, .png, .hdr or .pfm");
}

[[noreturn]] void cannot_write(const std::string& path, const std::string& why) {
  throw Error(ErrorKind::kFailed, path + ": can't write the image: " + library_message(why));
}

/// Where the bytes go in the end: a symbolic link keeps pointing to its file.
fs::path final_path(const std::string& path) {
  std::error_code ec;
  if (!fs::is_symlink(path, ec)) return path;
  const fs::path target = fs::weakly_canonical(path, ec);
  return ec ? fs::path(path) : target;
}

/// A name in the same folder (so that rename is atomic) with the same extension (so that the format stays).
fs::path temporary_beside(const fs::path& path) {
  static std::atomic<unsigned> serial{0};
  std::string name(1, '.');
  name += path.stem().string();
  name += '.' + std::to_string(::getpid()) + '-' + std::to_string(serial++);
  name += path.extension().string();
  return path.parent_path() / name;
}

std::vector<uint8_t> to_bytes(const Image& image, const ViewTransform& view) {
  std::vector<uint8_t> bytes(image.data.size());
  // A part at a time, as views are of floats.
  constexpr size_t kPixelsAtOnce = 1 << 14;
  const auto channels = static_cast<size_t>(image.channels);
  std::vector<float> shown(kPixelsAtOnce * channels);
  for (size_t at = 0; at < bytes.size(); at += shown.size()) {
    const size_t values = std::min(shown.size(), bytes.size() - at);
    view_pixels(&image.data[at], values / channels, image.channels, view, shown.data());
    for (size_t i = 0; i < values; ++i) bytes[at + i] = static_cast<uint8_t>(std::lround(255.0f * shown[i]));
  }
  return bytes;
}

ImageToWrite::Encoding encoding_of(const ViewTransform& view) {
  // Which of its spaces is sRGB a configuration does not say.
  if (view.of_config) return ImageToWrite::Encoding::kUnknown;
  return view.curve == ViewCurve::kNone ? ImageToWrite::Encoding::kLinear : ImageToWrite::Encoding::kSrgb;
}

/// The layers' channels, if there are any, behind the image's own, as one image. Throws std::logic_error on
/// layers of another size.
ChannelImage with_layers(const Image& image, const ChannelImage* layers) {
  const int extra = layers ? layers->image.channels : 0;
  if (layers && (layers->image.width != image.width || layers->image.height != image.height ||
                 layers->channels.size() != static_cast<size_t>(extra))) {
    throw std::logic_error("write_image: layers of another size than the image");
  }
  ChannelImage all{Image(image.width, image.height, image.channels + extra), {"R", "G", "B"}};
  all.channels.resize(static_cast<size_t>(image.channels));
  if (layers) all.channels.insert(all.channels.end(), layers->channels.begin(), layers->channels.end());
  const auto own = static_cast<size_t>(image.channels), more = static_cast<size_t>(extra);
  const size_t pixels = image.data.size() / own;
  for (size_t i = 0; i < pixels; ++i) {
    float* to = &all.image.data[i * (own + more)];
    std::copy_n(&image.data[i * own], own, to);
    if (layers) std::copy_n(&layers->image.data[i * more], more, to + own);
  }
  return all;
}

/// Half floats can't hold it.
bool is_wide(const std::string& channel) {
  return channel.starts_with("depth") || channel.starts_with("position.") ||
         channel.starts_with("samples.") || channel.starts_with("uv.") || channel.starts_with("objectid.") ||
         channel.starts_with("materialid.") || is_matte_channel(channel);
}

std::array<float, 8> chromaticities_of(const RgbPrimaries& p) {
  std::array<float, 8> xy{};
  size_t at = 0;
  for (const auto& point : {p.red, p.green, p.blue, p.white}) {
    for (const double coordinate : point) xy[at++] = static_cast<float>(coordinate);
  }
  return xy;
}

/// What an EXR says besides its pixels, and these, which stay in `image` or go into `all`.
void describe_exr(const Image& image, const ImageWriteOptions& options, ChannelImage* all,
                  ImageToWrite* out) {
  out->half = options.half;
  out->chromaticities = chromaticities_of(primaries_of(options.space));
  const bool layered = options.layers && !options.layers->channels.empty();
  if (layered) out->attributes.assign(options.layers->attributes.begin(), options.layers->attributes.end());
  for (const auto& [key, value] : options.metadata) out->attributes.emplace_back("lightmill:" + key, value);
  out->attributes.emplace_back("colorInteropID", interop_id(options.space));
  out->floats = image.data.data();
  // A grey is the same in all of them.
  const bool converted = options.space != ImageSpace::kRec709 && image.channels == 3;
  if (!layered && !converted) return;
  *all = with_layers(image, layered ? options.layers : nullptr);
  if (converted) convert_colors(all, *rgb_conversion(kRec709Primaries, primaries_of(options.space)));
  for (size_t i = static_cast<size_t>(image.channels); i < all->channels.size(); ++i)
    out->layers.push_back({all->channels[i], is_wide(all->channels[i])});
  out->floats = all->image.data.data();
}

/// Into `memory` if it is not null.
void write_by_library(const Image& image, Format format, const fs::path& path,
                      const ImageWriteOptions& options, std::vector<unsigned char>* memory) {
  ImageToWrite out;
  ChannelImage all;
  std::vector<uint8_t> bytes;
  if (format == Format::kPng) {
    out.format = ImageToWrite::Format::kPng;
    out.encoding = encoding_of(options.view);
    bytes = to_bytes(image, options.view);
    out.bytes = bytes.data();
  } else if (format == Format::kHdr) {
    out.format = ImageToWrite::Format::kHdr;
    out.floats = image.data.data();
  } else {
    describe_exr(image, options, &all, &out);
  }
  out.width = image.width;
  out.height = image.height;
  out.channels = image.channels + static_cast<int>(out.layers.size());
  std::string why;
  if (!image_library().write(out, path.string(), memory, &why)) cannot_write(path.string(), why);
}

void check_shape(const Image& image, const std::string& path) {
  if (image.width < 1 || image.height < 1 || (image.channels != 1 && image.channels != 3) ||
      image.data.size() != static_cast<size_t>(image.width) * static_cast<size_t>(image.height) *
                               static_cast<size_t>(image.channels)) {
    cannot_write(path, "it has no pixels");
  }
}

}  // namespace

float linear_to_srgb(float linear) {
  if (!(linear > 0)) return 0;  // also NaN
  if (linear >= 1) return 1;
  if (linear <= 0.0031308f) return 12.92f * linear;
  return 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

float srgb_to_linear(float encoded) {
  if (encoded <= 0.04045f) return encoded / 12.92f;
  return std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

Image reduced(const Image& image, int max_side) {
  const int block = (std::max(image.width, image.height) + max_side - 1) / max_side;
  if (block <= 1) return image;
  Image small((image.width + block - 1) / block, (image.height + block - 1) / block, image.channels);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      const int x1 = std::min((x + 1) * block, image.width), y1 = std::min((y + 1) * block, image.height);
      for (int c = 0; c < image.channels; ++c) {
        double sum = 0;
        for (int v = y * block; v < y1; ++v) {
          for (int u = x * block; u < x1; ++u) sum += image.pixel(u, v)[c];
        }
        small.pixel(x, y)[c] = static_cast<float>(sum / ((x1 - x * block) * (y1 - y * block)));
      }
    }
  }
  return small;
}

void write_image(const Image& image, const std::string& path, const ImageWriteOptions& options) {
  const Format format = format_of(path);
  check_shape(image, path);
  const fs::path target = final_path(path);
  const fs::path temporary = temporary_beside(target);
  std::error_code ec;
  try {
    if (format == Format::kPfm) {
      std::string why;
      if (!write_pfm(image, temporary.string(), &why)) cannot_write(temporary.string(), why);
    } else {
      write_by_library(image, format, temporary, options, nullptr);
    }
    fs::rename(temporary, target, ec);
    if (ec) cannot_write(path, ec.message());
  } catch (const Error& e) {
    fs::remove(temporary, ec);
    // Name the file that was asked for, not the temporary one.
    std::string message = e.what();
    for (size_t at; (at = message.find(temporary.string())) != std::string::npos;) {
      message.replace(at, temporary.string().size(), path);
    }
    throw Error(e.kind(), message);
  }
}

std::string encode_png(const Image& image) {
  check_shape(image, "image.png");
  std::vector<unsigned char> bytes;
  write_by_library(image, Format::kPng, "image.png", {}, &bytes);
  return {bytes.begin(), bytes.end()};
}

void check_writable(const std::string& path) {
  if (format_of(path) != Format::kPfm) image_library();
  std::error_code ec;
  if (fs::is_directory(path, ec)) cannot_write(path, "it is a folder; name a file in it");
  const fs::path target = final_path(path);
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ec))
    cannot_write(path, "there is no folder " + folder.string() + "; make it first");
  const fs::path probe = temporary_beside(target);
  {
    std::ofstream out(probe, std::ios::binary);
    if (!out) {
      cannot_write(path, "the folder " + folder.string() + " can't be written to (" +
                             std::error_code(errno, std::generic_category()).message() + ")");
    }
  }
  fs::remove(probe, ec);
}

}  // namespace lightmill
