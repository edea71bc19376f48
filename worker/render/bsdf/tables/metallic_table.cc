#include "worker/render/bsdf/tables/metallic_table.h"

#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/fresnel.h"
#include "worker/render/bsdf/tables/facet_quadrature.h"

namespace lightmill {
namespace {

void add_row(float alpha, std::vector<float>* table) {
  constexpr int kSide = 32;
  const Ggx<float> ggx{alpha};
  std::array<std::vector<LobeSample>, kCosineNodes> lobe;
  std::array<std::vector<float>, kCosineNodes> schlick;
  std::array<double, kCosineNodes> white;
  white.fill(1);
  for (size_t n = 0; n < kCosineNodes; ++n) {
    for_each_reflection(ggx, node_cosine(static_cast<int>(n)), kSide,
                        [&](float weight, float facet, const Vec3<float>& wi) {
                          lobe[n].push_back({weight, wi.z});
                          schlick[n].push_back(schlick_weight(facet));
                        });
  }
  const CosineRow g = balance(lobe, white);
  for (size_t n = 0; n < kCosineNodes; ++n) {
    double a = 0, b = 0, c = 0;
    for (size_t i = 0; i < lobe[n].size(); ++i) {
      const double k = lobe[n][i].weight, s = schlick[n][i];
      a += (1 - s) * k;
      b += s * k;
      c += s * k * g[n] * CosinePlace<float>(lobe[n][i].cosine).in(g.data(), 0);
    }
    for (const double x : {double{g[n]}, a, b, c}) table->push_back(static_cast<float>(x));
  }
}

}  // namespace

const std::vector<float>& metallic_table() {
  static const std::vector<float> table = [] {
    std::vector<float> t;
    for (int i = 0; i < kMetallicAlphas; ++i) {
      const float x = static_cast<float>(i) / (kMetallicAlphas - 1);
      add_row(std::max(x * x, kSmoothAlpha), &t);
    }
    for (int i = 0; i < kMetallicAlphas; ++i) {
      for (const int k : {1, 2, 3})
        t.push_back(hemispherical_mean(t.data() + i * kCosineNodes * kMetallicValues + k, kMetallicValues));
    }
    return t;
  }();
  return table;
}

float mean_lobe_albedo(const float* table, float alpha, float f0, float f90) {
  const float y = std::sqrt(std::clamp(alpha, 0.0f, 1.0f)) * (kMetallicAlphas - 1);
  const int j = std::min(static_cast<int>(y), kMetallicAlphas - 2);
  const float t = y - static_cast<float>(j);
  const float* row = table + kMetallicMeans + 3 * j;
  const auto value = [&](int k) { return row[k] + (row[k + 3] - row[k]) * t; };
  const float a = value(0), b = value(1), c = value(2);
  return f0 * (a + f0 * (1 - c - a)) + f90 * (b + f0 * (c - b));
}

}  // namespace lightmill
