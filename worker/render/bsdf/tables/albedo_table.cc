#include "worker/render/bsdf/tables/albedo_table.h"

#include <algorithm>
#include <cmath>

namespace lightmill {

float node_cosine(int i) {
  return std::max(static_cast<float>(i), 0.25f) / static_cast<float>(kCosineNodes - 1);
}

float hemispherical_mean(const float* row, int stride) {
  constexpr double kStep = 1.0 / (kCosineNodes - 1);
  double sum = 0;
  for (int i = 0; i + 1 < kCosineNodes; ++i) {
    const double low = i * kStep, high = low + kStep, a = row[i * stride], b = row[(i + 1) * stride];
    // Of a linear function times mu: Simpson's rule is exact.
    sum += (a * low + (a + b) * (low + high) + b * high) * kStep / 6;
  }
  return static_cast<float>(2 * sum);
}

CosineRow balance(const std::array<std::vector<LobeSample>, kCosineNodes>& lobe,
                  const std::array<double, kCosineNodes>& albedo) {
  constexpr int kIterations = 48;  // the square root halves the error at least
  CosineRow g;
  g.fill(1);
  for (int n = 0; n < kIterations; ++n) {
    CosineRow next = g;
    for (size_t i = 0; i < kCosineNodes; ++i) {
      double sum = 0;
      for (const LobeSample& s : lobe[i])
        sum += double{s.weight} * CosinePlace<float>(s.cosine).in(g.data(), 0);
      if (sum > 0) next[i] = static_cast<float>(std::sqrt(double{g[i]} * albedo[i] / sum));
    }
    g = next;
  }
  return g;
}

}  // namespace lightmill
