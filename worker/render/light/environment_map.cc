#include "worker/render/light/environment_map.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "worker/render/light/alias_table.h"

namespace lightmill {
namespace {

constexpr int kMaxSide = 8192;
/// Filters leave small negative values beside bright texels: up to this fraction of the brightest they count
/// as 0, below they are an error.
constexpr float kRinging = 0.01f;

/// Throws for the first texel that is no radiance; like pbrt, which takes no NaN or infinity either.
void check_texels(const std::string& path, const std::vector<float>& rgb, int width) {
  float brightest = 0;
  for (const float x : rgb) brightest = std::isfinite(x) ? std::max(brightest, x) : brightest;
  for (size_t i = 0; i < rgb.size(); ++i) {
    if (std::isfinite(rgb[i]) && rgb[i] >= -kRinging * brightest) continue;
    const auto texel = static_cast<int>(i / 3);
    throw Error(ErrorKind::kBadScene, path + ": texel (" + std::to_string(texel % width) + ", " +
                                          std::to_string(texel / width) + ") of the environment image is " +
                                          (std::isfinite(rgb[i]) ? "negative"
                                           : std::isnan(rgb[i])  ? "not a number"
                                                                 : "infinite") +
                                          "; paint it over or clamp the image");
  }
}

}  // namespace

EnvironmentMap::EnvironmentMap(const std::string& path, const Rgb& scale, const Transform& light_to_world) {
  auto in = OIIO::ImageInput::open(path);
  if (!in) throw Error(ErrorKind::kFailed, path + ": environment image can't be read: " + OIIO::geterror());
  const OIIO::ImageSpec spec = in->spec();
  if (spec.width != spec.height || spec.width < 1 || spec.width > kMaxSide || spec.nchannels < 3) {
    throw Error(
        ErrorKind::kFailed,
        path + ": an environment is a square equal-area RGB image of at most 8192 texels a side, this has " +
            std::to_string(spec.width) + " x " + std::to_string(spec.height) + " and " +
            std::to_string(spec.nchannels) + " channel(s)" +
            (spec.width == 2 * spec.height
                 ? "; a lat-long picture is converted by pbrt's imgtool makeequiarea"
                 : "; convert it with pbrt's imgtool makeequiarea"));
  }
  side = spec.width;
  const size_t texels = static_cast<size_t>(side) * static_cast<size_t>(side);
  rgb.resize(3 * texels);
  if (!in->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, rgb.data())) {
    throw Error(ErrorKind::kFailed, path + ": environment image can't be read: " + in->geterror());
  }
  check_texels(path, rgb, spec.width);
  const float factor[3] = {scale.r, scale.g, scale.b};
  std::vector<double> weights(texels);
  for (size_t i = 0; i < texels; ++i) {
    for (size_t c = 0; c < 3; ++c) {
      float& x = rgb[3 * i + c];
      x = std::max(x, 0.0f) * factor[c];
      if (!std::isfinite(x)) {
        throw Error(ErrorKind::kBadScene,
                    path + ": the environment is brighter than float can hold; lower its \"scale\"");
      }
      brightest = std::max(brightest, x);
      weights[i] += x / 3.0;
    }
    mean_radiance += weights[i] / static_cast<double>(texels);
  }
  if (!(brightest > 0)) throw Error(ErrorKind::kFailed, path + ": the environment image is black");
  const std::vector<double> probability = build_alias_table(weights, &alias_keep, &alias);
  density.resize(texels);
  for (size_t i = 0; i < texels; ++i)
    density[i] = static_cast<float>(probability[i] * static_cast<double>(texels));
  // Columns of the rotation, without scale.
  const auto& m = light_to_world.m;
  for (size_t j = 0; j < 3; ++j) {
    const double length = std::sqrt(m[0][j] * m[0][j] + m[1][j] * m[1][j] + m[2][j] * m[2][j]);
    if (!(length > 0))
      throw Error(ErrorKind::kBadScene, path + ": the infinite light's transform is singular");
    for (size_t i = 0; i < 3; ++i) to_light[3 * j + i] = static_cast<float>(m[i][j] / length);
  }
}

}  // namespace lightmill
