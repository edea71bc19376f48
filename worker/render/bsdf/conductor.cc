#include "worker/render/bsdf/conductor.h"

#include "worker/render/bsdf/tables/facet_quadrature.h"

namespace lightmill {

CosineRow compensation_row(float alpha) {
  constexpr int kSide = 64;  // the albedo is then right to 1e-3
  const Ggx<float> ggx{alpha};
  std::array<std::vector<LobeSample>, kCosineNodes> lobe;
  std::array<double, kCosineNodes> albedo;
  albedo.fill(1);
  for (int n = 0; n < kCosineNodes; ++n) {
    for_each_reflection(ggx, node_cosine(n), kSide, [&](float weight, float, const Vec3<float>& wi) {
      lobe[static_cast<size_t>(n)].push_back({weight, wi.z});
    });
  }
  return balance(lobe, albedo);
}

}  // namespace lightmill
