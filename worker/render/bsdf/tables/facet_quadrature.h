#pragma once
// Sums over a lobe of facets, for the tables that are made of it.
#include <cmath>

#include "worker/render/bsdf/ggx.h"

namespace lightmill {

/// Calls visit(weight, facet, wi) for what facets of `ggx` reflect above the surface, seen at `cosine`:
/// `side` x `side` midpoints of the visible normals' square (ggx.h). The weights, k cos / pdf over the number
/// of points, sum to the lobe's albedo for facets that reflect everything; `facet` is the cosine at the
/// facet.
template <class Visit>
inline void for_each_reflection(const Ggx<float>& ggx, float cosine, int side, Visit&& visit) {
  const Vec3<float> wo{std::sqrt(1 - cosine * cosine), 0, cosine};
  const auto n = static_cast<float>(side);
  for (int row = 0; row < side; ++row) {
    const float v = (static_cast<float>(row) + 0.5f) / n;
    for (int column = 0; column < side; ++column) {
      const float u = (static_cast<float>(column) + 0.5f) / n;
      const Vec3<float> m = ggx.sample_visible(wo, u, v);
      const float facet = dot(wo, m);
      const Vec3<float> wi = m * (2.0f * facet) - wo;
      if (wi.z > 0) visit(ggx.g(wo, wi) / ggx.g1(wo) / (n * n), facet, wi);
    }
  }
}

}  // namespace lightmill
