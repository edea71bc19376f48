#include "worker/render/scene/media/cloud.h"

#include <algorithm>
#include <cmath>

#include "common/base/parallel.h"
#include "worker/render/scene/textures/noise.h"

namespace lightmill {
namespace {

/// How much finer an octave is than the one before.
constexpr float kLacunarity = 1.99f;
constexpr int kOctaves = 5, kBends = 2;
constexpr float kFirstBend = 10;

NoisePoint scaled(const NoisePoint& p, float s) { return {p.x * s, p.y * s, p.z * s}; }

/// The gradient of the noise by differences.
NoisePoint noise_gradient(const NoisePoint& p) {
  constexpr float kDelta = 0.01f;
  const float n = gradient_noise(p);
  return {(gradient_noise({p.x + kDelta, p.y, p.z}) - n) / kDelta,
          (gradient_noise({p.x, p.y + kDelta, p.z}) - n) / kDelta,
          (gradient_noise({p.x, p.y, p.z + kDelta}) - n) / kDelta};
}

}  // namespace

float cloud_density(const CloudDensity& cloud, const Vec3d& p) {
  NoisePoint at =
      scaled({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}, cloud.frequency);
  if (cloud.wispiness > 0) {
    float omega = 0.05f * cloud.wispiness, lambda = kFirstBend;
    for (int i = 0; i < kBends; ++i) {
      const NoisePoint bend = noise_gradient(scaled(at, lambda));
      at = {at.x + omega * bend.x, at.y + omega * bend.y, at.z + omega * bend.z};
      omega *= 0.5f;
      lambda *= kLacunarity;
    }
  }
  float noise = 0, omega = 0.5f, lambda = 1;
  for (int i = 0; i < kOctaves; ++i) {
    noise += omega * gradient_noise(scaled(at, lambda));
    omega *= 0.5f;
    lambda *= kLacunarity;
  }
  const auto y = static_cast<float>(p.y);
  const float d = std::clamp((1 - y) * 4.5f * cloud.density * noise, 0.0f, 1.0f);
  return std::clamp(d + 2 * std::max(0.0f, 0.5f - y), 0.0f, 1.0f);
}

VolumeField cloud_field(const CloudDensity& cloud, const Vec3d& lo, const Vec3d& hi, int threads) {
  const double finest = double{cloud.frequency} * (cloud.wispiness > 0 ? kFirstBend * kLacunarity
                                                                       : std::pow(kLacunarity, kOctaves - 1));
  const double sides[3] = {hi.x - lo.x, hi.y - lo.y, hi.z - lo.z};
  const double longest = *std::max_element(sides, sides + 3);
  const double per_unit = std::min(4 * finest, kMostCloudVoxels / longest);
  int count[3];
  double half[3];
  for (int i = 0; i < 3; ++i) {
    count[i] = std::max(1, static_cast<int>(std::ceil(sides[i] * per_unit)));
    half[i] = sides[i] / count[i] / 2;
    ++count[i];
  }
  VolumeField field;
  field.nx = count[0], field.ny = count[1], field.nz = count[2];
  field.lo = {lo.x - half[0], lo.y - half[1], lo.z - half[2]};
  field.hi = {hi.x + half[0], hi.y + half[1], hi.z + half[2]};
  const auto row = static_cast<size_t>(count[0]), layer = row * static_cast<size_t>(count[1]);
  field.values.resize(layer * static_cast<size_t>(count[2]));
  parallel_for(static_cast<size_t>(count[2]), threads, [&](size_t z) {
    for (size_t y = 0; y < static_cast<size_t>(count[1]); ++y) {
      for (size_t x = 0; x < row; ++x) {
        const auto at = [&](double from, int axis, size_t i) {
          return from + 2 * half[axis] * static_cast<double>(i);
        };
        field.values[z * layer + y * row + x] =
            cloud_density(cloud, {at(lo.x, 0, x), at(lo.y, 1, y), at(lo.z, 2, z)});
      }
    }
  });
  return field;
}

}  // namespace lightmill
