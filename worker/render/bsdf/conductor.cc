#include "worker/render/bsdf/conductor.h"

#include <cmath>

namespace lightmill {

CosineRow compensation_row(float alpha) {
  constexpr int kSide = 64;  // samples of a node: a square of midpoints; the albedo is then right to 1e-3
  const Ggx<float> ggx{alpha};
  std::array<std::vector<LobeSample>, kCosineNodes> lobe;
  std::array<double, kCosineNodes> albedo;
  albedo.fill(1);
  for (int n = 0; n < kCosineNodes; ++n) {
    const float cosine = node_cosine(n);
    const Vec3<float> wo{std::sqrt(1 - cosine * cosine), 0, cosine};
    for (int i = 0; i < kSide * kSide; ++i) {
      const float u = (static_cast<float>(i % kSide) + 0.5f) / kSide;
      const float v = (static_cast<float>(i / kSide) + 0.5f) / kSide;
      const Vec3<float> m = ggx.sample_visible(wo, u, v);
      const Vec3<float> wi = m * (2.0f * dot(wo, m)) - wo;
      if (!(wi.z > 0)) continue;
      lobe[static_cast<size_t>(n)].push_back({ggx.g(wo, wi) / ggx.g1(wo) / (kSide * kSide), wi.z});
    }
  }
  return balance(lobe, albedo);
}

}  // namespace lightmill
