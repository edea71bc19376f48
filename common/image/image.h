#pragma once
// A float image in memory, and its files (image_library.h; PFM is our own).
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/image/image_space.h"
#include "common/image/view_transform.h"

namespace lightmill {

/// Row-major, interleaved RGB (or `channels`) floats, top row first. Linear Rec.709 unless said otherwise.
struct Image {
  int width = 0, height = 0, channels = 3;
  std::vector<float> data;
  Image() = default;
  Image(int w, int h, int c = 3)
      : width(w),
        height(h),
        channels(c),
        data(static_cast<size_t>(w) * static_cast<size_t>(h) * static_cast<size_t>(c)) {}
  float* pixel(int x, int y) {
    return &data[(static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) *
                 static_cast<size_t>(channels)];
  }
  const float* pixel(int x, int y) const { return const_cast<Image*>(this)->pixel(x, y); }
};

/// An image whose channels have names.
struct ChannelImage {
  Image image;                        // image.channels values a pixel
  std::vector<std::string> channels;  // their names in a file: "albedo.R"
  /// What an EXR file has to say of the channels: string attributes by their full names, as those of
  /// Cryptomatte.
  std::map<std::string, std::string> attributes = {};
};

struct ImageWriteOptions {
  bool half = false;                              // EXR only
  std::map<std::string, std::string> metadata{};  // EXR string attributes "lightmill:KEY"
  const ChannelImage* layers = nullptr;           // EXR only: more channels, of the same size; may be empty
  ViewTransform view = {};                        // PNG only
  ImageSpace space = ImageSpace::kRec709;         // EXR only: what the colours are converted to
};

/// Writes by extension: .exr (float or half, with metadata and layers), .png (8-bit, as `view` says), .hdr,
/// .pfm. In half floats distances, positions, counts and mattes stay floats: half has 11 bits. An .exr says
/// its primaries; convert_colors (color_channels.h) says what of it is converted to others. Written to a
/// temporary file beside `path` and renamed, so a reader never sees half an image. Throws Error(kFailed) if
/// it can't be written, Error(kUsage) on an unknown extension.
void write_image(const Image& image, const std::string& path, const ImageWriteOptions& options = {});
/// The bytes of a PNG file (8-bit sRGB). Throws Error(kFailed) on an image without pixels.
std::string encode_png(const Image& image);
/// The image with its longer side cut to at most `max_side` >= 1 pixels, by averaging whole blocks of pixels.
Image reduced(const Image& image, int max_side);
/// The sRGB transfer functions (IEC 61966-2-1); `linear_to_srgb` clamps to [0, 1] and maps NaN to 0.
float linear_to_srgb(float linear);
float srgb_to_linear(float encoded);
/// Throws Error(kUsage) on an unknown extension and Error(kFailed) if the folder can't be written to or the
/// library can't be loaded that writes the format; to be called before a long render.
void check_writable(const std::string& path);
/// Reads any image OpenImageIO can; PNG and JPEG are converted from sRGB to linear, an .exr that says other
/// primaries to Rec.709. First 3 channels (a single channel is replicated). Throws Error(kFailed).
Image read_image(const std::string& path);
/// All channels of a file of floats with their names and the attributes of Cryptomatte: as stored, or if it
/// says other primaries, with its colours converted to Rec.709 by convert_colors. Throws Error(kFailed), also
/// where the file has integers, and Error(kUsage) if there are more than `max_pixels`.
ChannelImage read_channels(const std::string& path, int64_t max_pixels);
/// What an image file says of its primaries: nothing if they are none that can be written; Rec.709 if it says
/// nothing. Throws Error(kFailed) if it can't be read.
std::optional<ImageSpace> read_image_space(const std::string& path);
/// ImageWriteOptions::metadata[key] of an image file; empty if it has none. Throws Error(kFailed) if it can't
/// be read.
std::string read_image_metadata(const std::string& path, const std::string& key);

}  // namespace lightmill
