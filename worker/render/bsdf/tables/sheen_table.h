#pragma once
// Directional albedo of sheen, tabulated over cosine and roughness.
//
// glTF's sheen (KHR_materials_sheen) is D(h) V(wo, wi), Estevez and Kulla's "Charlie" distribution with their
// fit of its masking ("Production Friendly Microfacet Sheen BRDF", 2017). As it stands smooth sheen reflects
// up to three times what it gets at grazing angles. With E its directional albedo it is divided here by
// max(1, E(wo), E(wi)): reciprocal, lossless at most, and glTF's own wherever that is.
#include <vector>

#include "worker/render/bsdf/tables/albedo_lookup.h"
#include "worker/render/bsdf/tables/metallic_table.h"

namespace lightmill {

/// Rows for the roughnesses i / (kSheenRows - 1), of two numbers per cosine: E above, and the albedo of what
/// it is divided to.
inline constexpr int kSheenRows = 16, kSheenValues = 2;
/// Where they are: behind the metallic table.
inline constexpr int kSheenTable = kMetallicMeans + 3 * kMetallicAlphas;
/// Smoother fibres are nearly all edge.
inline constexpr float kLeastSheenRoughness = 0.07f;

/// All rows, node by node; made once per process.
const std::vector<float>& sheen_table();

template <class F>
struct SheenAlbedo {
  F raw, albedo;

  /// `table` is where the metallic table begins.
  SheenAlbedo(const float* table, F cosine, F roughness) {
    const F row = clamp(roughness, 0.0f, 1.0f) * static_cast<float>(kSheenRows - 1);
    const AlbedoLookup<F, kSheenValues> value(table + kSheenTable, kSheenRows, cosine, row);
    raw = value(0);
    albedo = clamp(value(1), 0.0f, 1.0f);
  }
};

}  // namespace lightmill
