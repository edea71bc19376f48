#include "worker/render/light/environment_map.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "worker/render/light/alias_table.h"

namespace lightmill {
namespace {

constexpr int kMaxSide = 8192, kMaxPanorama = 16384;
/// Side of what panoramas are resampled to, at most: 200 MB.
constexpr int kMaxResampledSide = 4096;
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

void decode_srgb(std::vector<float>* rgb) {
  for (float& x : *rgb) x = x <= 0.04045f ? x / 12.92f : std::pow((x + 0.055f) / 1.055f, 2.4f);
}

/// Bilinear lookup of a panorama that goes round horizontally, in world direction `w`.
void look_up(const std::vector<float>& rgb, int width, int height, const Vec3<float>& w, double sum[3]) {
  const float u = turns(-w.z, -w.x) + 0.5f;  // the middle of the picture is -x
  const float v = 2 * turns(std::sqrt(w.x * w.x + w.z * w.z), w.y);
  const float x = u * static_cast<float>(width) - 0.5f, y = v * static_cast<float>(height) - 0.5f;
  const float fx = std::floor(x), fy = std::floor(y), tx = x - fx, ty = y - fy;
  const auto row = [&](int i) { return static_cast<size_t>(std::clamp(i, 0, height - 1)); };
  const auto column = [&](int i) { return static_cast<size_t>((i % width + width) % width); };
  const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const float* p = &rgb[3 * (row(iy + dy) * static_cast<size_t>(width) + column(ix + dx))];
      const double weight = double{dx ? tx : 1 - tx} * (dy ? ty : 1 - ty);
      for (int c = 0; c < 3; ++c) sum[c] += weight * p[c];
    }
  }
}

/// The same radiance as an equal-area image of about as many texels.
std::vector<float> equal_area_of_panorama(const std::vector<float>& rgb, int width, int height,
                                          int32_t* side) {
  constexpr int kSamples = 3;  // a side, per texel
  const int n = std::clamp(static_cast<int>(std::sqrt(double{1.0} * width * height)), 2, kMaxResampledSide);
  std::vector<float> out(3 * static_cast<size_t>(n) * static_cast<size_t>(n));
  const float step = 1 / static_cast<float>(n);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      double sum[3] = {};
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const float s = (static_cast<float>(x) + (static_cast<float>(k % kSamples) + 0.5f) / kSamples) * step;
        const float t = (static_cast<float>(y) + (static_cast<float>(k / kSamples) + 0.5f) / kSamples) * step;
        look_up(rgb, width, height, equal_area_square_to_sphere(s, t), sum);
      }
      float* texel = &out[3 * (static_cast<size_t>(y) * static_cast<size_t>(n) + static_cast<size_t>(x))];
      for (int c = 0; c < 3; ++c) texel[c] = static_cast<float>(sum[c] / (kSamples * kSamples));
    }
  }
  *side = n;
  return out;
}

}  // namespace

EnvironmentMap::EnvironmentMap(const std::string& path, const Rgb& scale, const Transform& light_to_world,
                               bool lat_long) {
  auto in = OIIO::ImageInput::open(path);
  if (!in) throw Error(ErrorKind::kFailed, path + ": environment image can't be read: " + OIIO::geterror());
  const OIIO::ImageSpec spec = in->spec();
  if (lat_long && (spec.width < 2 || spec.height < 2 || spec.width > kMaxPanorama ||
                   spec.height > kMaxPanorama || spec.nchannels < 3)) {
    throw Error(ErrorKind::kFailed,
                path + ": an environment is a lat-long RGB image of 2 to 16384 texels a side, this has " +
                    std::to_string(spec.width) + " x " + std::to_string(spec.height) + " and " +
                    std::to_string(spec.nchannels) + " channel(s)");
  }
  if (!lat_long &&
      (spec.width != spec.height || spec.width < 1 || spec.width > kMaxSide || spec.nchannels < 3)) {
    throw Error(
        ErrorKind::kFailed,
        path + ": an environment is a square equal-area RGB image of at most 8192 texels a side, this has " +
            std::to_string(spec.width) + " x " + std::to_string(spec.height) + " and " +
            std::to_string(spec.nchannels) + " channel(s)" +
            (spec.width == 2 * spec.height
                 ? "; a lat-long picture is converted by pbrt's imgtool makeequiarea"
                 : "; convert it with pbrt's imgtool makeequiarea"));
  }
  rgb.resize(3 * static_cast<size_t>(spec.width) * static_cast<size_t>(spec.height));
  if (!in->read_image(0, 0, 0, 3, OIIO::TypeDesc::FLOAT, rgb.data())) {
    throw Error(ErrorKind::kFailed, path + ": environment image can't be read: " + in->geterror());
  }
  check_texels(path, rgb, spec.width);
  side = spec.width;
  if (lat_long) {
    const bool bytes = spec.format == OIIO::TypeDesc::UINT8;
    if (bytes) decode_srgb(&rgb);
    rgb = equal_area_of_panorama(rgb, spec.width, spec.height, &side);
  }
  const size_t texels = static_cast<size_t>(side) * static_cast<size_t>(side);
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
