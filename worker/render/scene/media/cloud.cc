#include "worker/render/scene/media/cloud.h"

#include <algorithm>
#include <cmath>

#include "common/base/parallel.h"
#include "worker/render/scene/textures/gradient_noise.h"

namespace lightmill {
namespace {

/// How much finer an octave is than the one before.
constexpr float kLacunarity = 1.99f;
constexpr int kOctaves = 5, kBends = 2;
constexpr float kFirstBend = 10;

/// The gradient of the noise by differences.
template <class F>
Vec3<F> noise_gradient(const Vec3<F>& p) {
  constexpr float kDelta = 0.01f;
  const F n = gradient_noise<F>(p);
  const auto slope = [&](const Vec3<F>& beside) { return (gradient_noise<F>(beside) - n) / kDelta; };
  return {slope({p.x + kDelta, p.y, p.z}), slope({p.x, p.y + kDelta, p.z}), slope({p.x, p.y, p.z + kDelta})};
}

template <class F>
F density_at(const CloudDensity& cloud, const Vec3<F>& p) {
  Vec3<F> at = p * splat<F>(cloud.frequency);
  if (cloud.wispiness > 0) {
    float omega = 0.05f * cloud.wispiness, lambda = kFirstBend;
    for (int i = 0; i < kBends; ++i) {
      at = at + noise_gradient<F>(at * splat<F>(lambda)) * splat<F>(omega);
      omega *= 0.5f;
      lambda *= kLacunarity;
    }
  }
  F noise{};
  float omega = 0.5f, lambda = 1;
  for (int i = 0; i < kOctaves; ++i) {
    noise += omega * gradient_noise<F>(at * splat<F>(lambda));
    omega *= 0.5f;
    lambda *= kLacunarity;
  }
  const F d = clamp((1.0f - p.y) * 4.5f * cloud.density * noise, 0.0f, 1.0f);
  return clamp(d + 2.0f * max(F{}, 0.5f - p.y), 0.0f, 1.0f);
}

}  // namespace

float cloud_density(const CloudDensity& cloud, const Vec3d& p) {
  return density_at<float>(cloud,
                           {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
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
  const auto at = [&](double from, int axis, size_t i) {
    return static_cast<float>(from + 2 * half[axis] * static_cast<double>(i));
  };
  constexpr size_t kLanes = kWidth<Float8>;
  parallel_for(static_cast<size_t>(count[2]), threads, [&](size_t z) {
    for (size_t y = 0; y < static_cast<size_t>(count[1]); ++y) {
      for (size_t x = 0; x < row; x += kLanes) {
        float xs[kLanes], density[kLanes];
        for (size_t l = 0; l < kLanes; ++l) xs[l] = at(lo.x, 0, x + l);
        store(density, density_at<Float8>(cloud, {load<Float8>(xs), splat<Float8>(at(lo.y, 1, y)),
                                                  splat<Float8>(at(lo.z, 2, z))}));
        std::copy_n(density, std::min(kLanes, row - x), &field.values[z * layer + y * row + x]);
      }
    }
  });
  return field;
}

}  // namespace lightmill
