#include "worker/render/light/light_image.h"

#include <algorithm>
#include <cmath>

#include "common/base/error.h"
#include "common/image/image.h"
#include "common/image/image_reader.h"
#include "common/image/qoi_file.h"

namespace lightmill {
namespace {

/// Filters leave small negative values beside bright texels: up to this fraction of the brightest they count
/// as 0, below they are an error.
constexpr float kRinging = 0.01f;

/// Throws for the first texel that is no radiance; like pbrt, which takes no NaN or infinity either.
void check_texels(const LightImage& image, const std::string& what) {
  float brightest = 0;
  for (const float x : image.rgb) brightest = std::isfinite(x) ? std::max(brightest, x) : brightest;
  for (size_t i = 0; i < image.rgb.size(); ++i) {
    const float x = image.rgb[i];
    if (std::isfinite(x) && x >= -kRinging * brightest) continue;
    const auto texel = static_cast<int>(i / 3);
    throw Error(ErrorKind::kBadScene, image.path + ": texel (" + std::to_string(texel % image.width) + ", " +
                                          std::to_string(texel / image.width) + ") of the " + what + " is " +
                                          (std::isfinite(x) ? "negative"
                                           : std::isnan(x)  ? "not a number"
                                                            : "infinite") +
                                          "; paint it over or clamp the image");
  }
}

}  // namespace

double LightImage::mean() const {
  double sum = 0;
  for (const float x : rgb) sum += double{x};
  return sum / static_cast<double>(rgb.size());
}

void LightImage::make_grey() {
  for (size_t i = 0; i < rgb.size(); i += 3)
    rgb[i] = rgb[i + 1] = rgb[i + 2] = (rgb[i] + rgb[i + 1] + rgb[i + 2]) / 3;
}

LightImage read_light_image(const std::string& path, const std::string& what, int max_side) {
  std::string why;
  ImageSource source{path};
  source.as_stored = true;  // alpha means nothing here
  const auto in = ImageReader::open(source, &why);
  if (!in) throw Error(ErrorKind::kBadScene, path + ": " + what + " can't be read: " + why);
  const ImageHeader& file = in->header();
  if (file.width < 1 || file.height < 1 || file.width > max_side || file.height > max_side ||
      file.channels < 1) {
    throw Error(ErrorKind::kBadScene, path + ": the " + what + " has " + std::to_string(file.width) + " x " +
                                          std::to_string(file.height) + " texels; at most " +
                                          std::to_string(max_side) + " a side are supported");
  }
  LightImage image{path, file.width, file.height, {}};
  const size_t texels = static_cast<size_t>(file.width) * static_cast<size_t>(file.height);
  const int channels = file.channels < 3 ? 1 : 3;
  image.rgb.resize(texels * static_cast<size_t>(channels));
  if (!in->read(0, channels, image.rgb.data(), &why))
    throw Error(ErrorKind::kBadScene, path + ": " + what + " can't be read: " + why);
  if (channels == 1) {
    std::vector<float> grey = std::move(image.rgb);
    image.rgb.resize(3 * texels);
    for (size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = grey[i / 3];
  }
  if (file.is_floating_point) {
    check_texels(image, what);
    for (float& x : image.rgb) x = std::max(x, 0.0f);
  } else if (!(file.says_linear && is_qoi(path))) {
    for (float& x : image.rgb) x = srgb_to_linear(x);
  }
  return image;
}

void light_axes(const Transform& light_to_world, const std::string& path, float to_light[9]) {
  const auto& m = light_to_world.m;
  for (size_t j = 0; j < 3; ++j) {
    const double length = std::sqrt(m[0][j] * m[0][j] + m[1][j] * m[1][j] + m[2][j] * m[2][j]);
    if (!(length > 0)) throw Error(ErrorKind::kBadScene, path + ": the light's transform is singular");
    for (size_t i = 0; i < 3; ++i) to_light[3 * j + i] = static_cast<float>(m[i][j] / length);
  }
}

}  // namespace lightmill
