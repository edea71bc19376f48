#pragma once
// Directional albedos of a GGX lobe under Schlick's Fresnel term, tabulated over cosine and roughness, for
// materials of which every parameter may be textured.
//
// With k the lobe for F = 1, s = (1 - cos)^5 at the facet and g the row that makes g(wo) g(wi) k white
// (conductor.h), the rows hold the integrals over wi
//   A = int (1 - s) k,   B = int s k,   C = int s g g k      (int (1 - s) g g k = 1 - C)
// by which the lobe of reflectances f0 and f90, compensated by 1 + f0 (g g - 1), has the albedo
//   E = f0 (A + f0 (1 - C - A)) + f90 (B + f0 (C - B)).
#include "worker/render/bsdf/tables/albedo_lookup.h"

namespace lightmill {

/// Rows for the alphas (i / (kMetallicAlphas - 1))^2, of kMetallicValues numbers per cosine, node by node.
inline constexpr int kMetallicAlphas = 20, kMetallicValues = 4;
/// Where the means of A, B and C over diffuse light, 2 int X(mu) mu dmu, begin: three per alpha.
inline constexpr int kMetallicMeans = kMetallicAlphas * kCosineNodes * kMetallicValues;

/// g, A, B, C of all rows, then the means; made once per process.
const std::vector<float>& metallic_table();

/// The four at a cosine and a roughness.
template <class F>
struct LobeAlbedo {
  F g, a, b, c;

  LobeAlbedo(const float* table, F cosine, F alpha) {
    const F row = sqrt(clamp(alpha, 0.0f, 1.0f)) * static_cast<float>(kMetallicAlphas - 1);
    const AlbedoLookup<F, kMetallicValues> value(table, kMetallicAlphas, cosine, row);
    g = value(0);
    a = value(1);
    b = value(2);
    c = value(3);
  }
  /// E above, within [0, 1].
  F albedo(F f0, F f90) const {
    const F e = f0 * (a + f0 * (1.0f - c - a)) + f90 * (b + f0 * (c - b));
    return clamp(e, 0.0f, 1.0f);
  }
};

/// Mean of E over diffuse light. `table` is the metallic table.
float mean_lobe_albedo(const float* table, float alpha, float f0, float f90);

}  // namespace lightmill
