#pragma once
// Tables over the cosine of a direction, by which lobes that have no closed albedo get the right one.
//
// A row is kCosineNodes values at the cosines i / (kCosineNodes - 1), interpolated linearly. `balance` finds
// the row g for which the reciprocal product g(wo) g(wi) k(wo, wi) of a symmetric lobe k has a given albedo
// in every direction (symmetric matrix scaling, Sinkhorn 1967). Rows are made when the scene is built, with
// the same bits everywhere, and stored in RenderScene::bsdf_tables.
#include <array>
#include <vector>

#include "worker/render/bsdf/bsdf.h"

namespace lightmill {

inline constexpr int kCosineNodes = 32;
using CosineRow = std::array<float, kCosineNodes>;

/// Cosine of node i; the first is a grazing direction, not 0.
float node_cosine(int i);

/// 2 int X(mu) mu dmu of a row, whose values are `stride` apart, as it is interpolated.
float hemispherical_mean(const float* row, int stride);

/// One sampled direction of a lobe: its weight k cos / pdf over the number of samples, and its cosine.
struct LobeSample {
  float weight, cosine;
};
/// g above, from samples of the lobe and the wanted albedo at every node. Where the lobe has no energy g
/// is 1.
CosineRow balance(const std::array<std::vector<LobeSample>, kCosineNodes>& lobe,
                  const std::array<double, kCosineNodes>& albedo);

/// Place between two nodes.
template <class F>
struct CosinePlace {
  IntOf<F> node;
  F t;
  explicit CosinePlace(F cosine) {
    const F x = clamp(cosine, 0.0f, 1.0f) * static_cast<float>(kCosineNodes - 1);
    node = to_int(min(x, splat<F>(kCosineNodes - 2)));
    t = x - to_float(node);
  }
  /// The value of the row that begins at `row`, a valid index for every lane.
  F in(const float* tables, IntOf<F> row) const {
    const F a = gather(tables, row + node), b = gather(tables + 1, row + node);
    return a + (b - a) * t;
  }
};

/// The row in parameter `slot`; the first one for lanes that are not of the kind.
template <class F>
inline IntOf<F> table_row(const BsdfParams<F>& params, int slot, MaskOf<F> of_kind) {
  return to_int(select(of_kind, params.p[slot], F{}));
}

}  // namespace lightmill
