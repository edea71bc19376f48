#include "worker/render/light/environment_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/error.h"
#include "worker/render/light/alias_table.h"

namespace lightmill {
namespace {

/// Largest side that panoramas are resampled to: 200 MB.
constexpr int kMaxResampledSide = 4096, kMaxPanorama = 16384;

/// Bilinear look-up, in world direction `w`, in a panorama that goes round horizontally.
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

/// The same radiance as an equal-area image of about as many texels, or more.
LightImage equal_area_of_panorama(const LightImage& from, int least_side) {
  constexpr int kSamples = 3;  // a side, per texel
  // A multiple of what next-event guides divide a side by.
  constexpr int kStep = BinnedDensity::kMostBins;
  const int about = std::max(static_cast<int>(std::sqrt(double{1.0} * from.width * from.height)), least_side);
  const int n = std::clamp((about + kStep / 2) / kStep * kStep, kStep, kMaxResampledSide);
  LightImage out{from.path, n, n, {}};
  out.rgb.resize(3 * static_cast<size_t>(n) * static_cast<size_t>(n));
  const float step = 1 / static_cast<float>(n);
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      double sum[3] = {};
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const int column = k % kSamples, row = k / kSamples;
        const float s = (static_cast<float>(x) + (static_cast<float>(column) + 0.5f) / kSamples) * step;
        const float t = (static_cast<float>(y) + (static_cast<float>(row) + 0.5f) / kSamples) * step;
        look_up(from.rgb, from.width, from.height, equal_area_square_to_sphere(s, t), sum);
      }
      float* texel = &out.rgb[3 * (static_cast<size_t>(y) * static_cast<size_t>(n) + static_cast<size_t>(x))];
      for (int c = 0; c < 3; ++c) texel[c] = static_cast<float>(sum[c] / (kSamples * kSamples));
    }
  }
  return out;
}

}  // namespace

LightImage read_environment(const std::string& path, bool lat_long, int least_side) {
  if (!lat_long) return read_light_image(path, "environment image");
  return equal_area_of_panorama(read_light_image(path, "environment image", kMaxPanorama), least_side);
}

EnvironmentMap::EnvironmentMap(const std::string& path, const Rgb& scale, const Transform& light_to_world,
                               bool lat_long)
    : EnvironmentMap(read_environment(path, lat_long), scale, light_to_world) {}

EnvironmentMap::EnvironmentMap(LightImage image, const Rgb& scale, const Transform& light_to_world) {
  if (image.width != image.height) {
    throw Error(ErrorKind::kBadScene,
                image.path +
                    ": an image over all directions is a square of pbrt's equal-area mapping, this has " +
                    std::to_string(image.width) + " x " + std::to_string(image.height) + " texels; convert " +
                    (image.width == 2 * image.height ? "a lat-long picture " : "it ") +
                    "with pbrt's imgtool makeequiarea");
  }
  light_axes(light_to_world, image.path, to_light);
  side = image.width;
  rgb = std::move(image.rgb);
  const size_t texels = rgb.size() / 3;
  const float factor[3] = {scale.r, scale.g, scale.b};
  for (size_t i = 0; i < texels; ++i) {
    for (size_t c = 0; c < 3; ++c) {
      float& x = rgb[3 * i + c];
      x *= factor[c];
      if (!std::isfinite(x)) {
        throw Error(ErrorKind::kBadScene,
                    image.path + ": the light is brighter than float can hold; lower its \"scale\"");
      }
      brightest = std::max(brightest, x);
    }
  }
  const std::vector<double> light = weights();
  for (const double w : light) mean_radiance += w / static_cast<double>(texels);
  if (!(brightest > 0))
    throw Error(ErrorKind::kBadScene, image.path + ": the light's image is black; leave the light out");
  draw_by(light);
}

std::vector<double> EnvironmentMap::weights() const {
  std::vector<double> light(rgb.size() / 3);
  for (size_t i = 0; i < rgb.size(); ++i) light[i / 3] += rgb[i] / 3.0;
  return light;
}

void EnvironmentMap::draw_by(const std::vector<double>& weights) {
  const size_t texels = weights.size();
  const std::vector<double> probability = build_alias_table(weights, &alias_keep, &alias);
  density.resize(texels);
  for (size_t i = 0; i < texels; ++i)
    density[i] = static_cast<float>(probability[i] * static_cast<double>(texels));
}

double EnvironmentMap::face(const Vec3f& n) {
  constexpr int kSamples = 4;  // a side, per texel
  const Vec3<float> axis = rotate_to_light<float>({n.x, n.y, n.z});
  std::vector<double> weights(density.size());
  const float step = 1 / static_cast<float>(side);
  double irradiance = 0;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(side) + static_cast<size_t>(x);
      double cosines = 0;
      bool front = false;
      // Corners too: a texel of which any part is in front must be drawn at times.
      for (int k = 0; k < kSamples * kSamples; ++k) {
        const int column = k % kSamples, row = k / kSamples;
        const float s = (static_cast<float>(x) + static_cast<float>(column) / (kSamples - 1)) * step;
        const float t = (static_cast<float>(y) + static_cast<float>(row) / (kSamples - 1)) * step;
        const double cosine = double{dot(equal_area_square_to_sphere(s, t), axis)};
        front = front || cosine > -0.01;
        cosines += std::max(cosine, 0.0) / (kSamples * kSamples);
      }
      const double radiance = (double{rgb[3 * i]} + rgb[3 * i + 1] + rgb[3 * i + 2]) / 3;
      irradiance += radiance * cosines * 4 * std::numbers::pi / static_cast<double>(weights.size());
      // Grazing texels at a tenth at least: the cosine varies within them, and the portal may be seen from
      // where it does not.
      if (front) weights[i] = radiance * std::max(cosines, 0.1);
    }
  }
  if (!(irradiance > 0))
    throw Error(ErrorKind::kBadScene,
                "no light comes through the light's portal; turn the portal or the light");
  draw_by(weights);
  return irradiance;
}

}  // namespace lightmill
