#include "common/image/denoise/features.h"

#include <algorithm>
#include <cmath>

namespace lightmill::denoise {

namespace {

constexpr int kFeatureRadius = 3;
constexpr int kVarianceRadius = 2;  // around which a feature's noise is taken to be alike
constexpr float kLeastVariance = 1e-7f;

}  // namespace

void scale_depth(Plane* depth, Plane* difference) {
  std::vector<float> hits;
  for (float& d : *depth) {
    if (!(d > 0) || !std::isfinite(d)) d = 0;
    if (d > 0) hits.push_back(d);
  }
  if (hits.empty()) return;
  const auto middle = hits.begin() + static_cast<std::ptrdiff_t>(hits.size() / 2);
  std::nth_element(hits.begin(), middle, hits.end());
  const float median = *middle;
  for (size_t i = 0; i < depth->size(); ++i) {
    const float d = (*depth)[i];
    // Nothing is as far as can be.
    (*depth)[i] = d > 0 ? std::clamp(std::log(d / median), -4.0f, 4.0f) : 4.0f;
    if (!difference->empty()) {
      const float by = d > 0 ? (*difference)[i] / d : 0;
      (*difference)[i] = std::isfinite(by) ? std::clamp(by, -1.0f, 1.0f) : 0;
    }
  }
}

namespace {

/// One half. Returns the sums of squared weights, over which the variance falls.
void filter_half(const Extent& extent, const std::array<Plane, kFeatures>& values,
                 const std::array<Plane, kFeatures>& variance, const DenoiseOptions& options,
                 std::array<Plane, kFeatures>* result, Plane* gain) {
  for (Plane& plane : *result) plane.resize(extent.pixels());
  gain->resize(extent.pixels());
  for_rows(extent, options.threads, [&](int y) {
    if (options.stop.stop_requested()) throw DenoiseStopped();
    const auto width = static_cast<size_t>(extent.width);
    const size_t begin = extent.at(0, y);
    std::vector<float> sum(width * kFeatures, 0.0f), total(width, 0.0f), square(width, 0.0f), distance(width);
    for (int dy = -kFeatureRadius; dy <= kFeatureRadius; ++dy) {
      if (y + dy < 0 || y + dy >= extent.height) continue;
      for (int dx = -kFeatureRadius; dx <= kFeatureRadius; ++dx) {
        const int x0 = std::max(0, -dx), x1 = std::min(extent.width, extent.width - dx);
        std::fill(distance.begin(), distance.end(), 0.0f);
        const auto offset = static_cast<std::ptrdiff_t>(dy) * extent.width + dx;
        for (size_t k = 0; k < kFeatures; ++k) {
          const float* f = &values[k][begin];
          const float* v = &variance[k][begin];
          for (int x = x0; x < x1; ++x) {
            const float d = f[x] - f[x + offset], noise = v[x] + std::min(v[x], v[x + offset]);
            distance[static_cast<size_t>(x)] +=
                std::max(0.0f, d * d - noise) / (kLeastVariance + v[x] + v[x + offset]);
          }
        }
        for (int x = x0; x < x1; ++x) {
          const auto i = static_cast<size_t>(x);
          const float near = std::max(0.0f, 1 - distance[i] * (1.0f / 6)), w = near * near * near;
          total[i] += w;
          square[i] += w * w;
          for (size_t k = 0; k < kFeatures; ++k) {
            sum[k * width + i] += w * values[k][begin + i + static_cast<size_t>(offset)];
          }
        }
      }
    }
    for (size_t i = 0; i < width; ++i) {
      for (size_t k = 0; k < kFeatures; ++k) (*result)[k][begin + i] = sum[k * width + i] / total[i];
      (*gain)[begin + i] = square[i] / (total[i] * total[i]);
    }
  });
}

}  // namespace

Features filter_features(const Extent& extent, std::array<Plane, kFeatures> values,
                         const std::array<Plane, kFeatures>& difference, const DenoiseOptions& options) {
  Features result;
  bool noisy = false;
  for (size_t k = 0; k < kFeatures; ++k) {
    Plane& variance = result.variance[k];
    variance.assign(extent.pixels(), 0.0f);
    if (difference[k].empty()) continue;
    for (size_t i = 0; i < extent.pixels(); ++i) {
      const float d = difference[k][i];
      variance[i] = 2 * d * d;
      noisy |= variance[i] > kLeastVariance;
    }
    box_mean(extent, kVarianceRadius, options.threads, &variance);
  }
  if (!noisy) {
    result.of[0] = values;
    result.of[1] = std::move(values);
    return result;
  }
  Plane gain[2];
  for (int h = 0; h < 2; ++h) {
    std::array<Plane, kFeatures> half = values;
    for (size_t k = 0; k < kFeatures; ++k) {
      if (difference[k].empty()) continue;
      for (size_t i = 0; i < extent.pixels(); ++i)
        half[k][i] += h == 0 ? difference[k][i] : -difference[k][i];
    }
    filter_half(extent, half, result.variance, options, &result.of[h], &gain[h]);
  }
  for (Plane& variance : result.variance) {
    for (size_t i = 0; i < extent.pixels(); ++i) variance[i] *= 0.5f * (gain[0][i] + gain[1][i]);
  }
  return result;
}

}  // namespace lightmill::denoise
