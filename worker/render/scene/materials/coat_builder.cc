#include "worker/render/scene/materials/coat_builder.h"

#include "worker/render/scene/materials/material_slots.h"

namespace lightmill {
namespace {

bool scatters(const CoatMediumDescription& medium) { return !(medium.albedo == Rgb{}); }

CoatMedium medium_of(const CoatMediumDescription& m) {
  return {{reflectance(m.albedo.r), reflectance(m.albedo.g), reflectance(m.albedo.b)}, m.g};
}

/// How much wider than the mean a lobe is along the tangent; 1 if it is round or its roughness is textured.
float anisotropy(const Roughness& r) {
  if (r.u.texture >= 0 || r.v.texture >= 0 || r.u.value == r.v.value) return 1;
  const float u = std::max(roughness_to_alpha(r.u.value, r.remap), kSmoothAlpha),
              v = std::max(roughness_to_alpha(r.v.value, r.remap), kSmoothAlpha);
  return std::sqrt(u / v);
}

bool is_coated_conductor(BsdfKind kind) {
  return kind == kSmoothCoatedConductor || kind == kCoatedConductor || kind == kRoughCoatedConductor ||
         kind == kScatteringCoatedConductor || kind == kRoughScatteringCoatedConductor ||
         kind == kAnisotropicCoatedConductor || kind == kAnisotropicRoughCoatedConductor;
}

/// Slots 0-2 from the base's reflectance, for the coat that `params` and `returned` describe.
void set_base(const MaterialEntry& entry, const std::array<double, 3>& returned, const Rgb& c,
              float* params) {
  const auto base = [&](float x, size_t channel) {
    return coated_base(reflectance(x), params[3], returned[channel], entry.coat_base_encounters);
  };
  set_rgb(params, 0, {base(c.r, 0), base(c.g, 1), base(c.b, 2)});
}

/// Slots of the metal and the coat's index: from eta and k against air, or from the reflectance.
void set_coated_metal(const MaterialEntry& e, float* params, const Rgb& reflectance_or_eta, const Rgb& k) {
  float air[6];
  if (e.conductor_reflectance) {
    set_conductor_reflectance(air, reflectance_or_eta);
  } else {
    set_eta(air, reflectance_or_eta);
    set_k(air, k);
  }
  for (int i = 0; i < 6; ++i) air[i] = index_part(air[i] / e.coat_eta, i < 3 ? kLeastIndex : 0);
  if (e.kind == kSmoothCoatedConductor) {
    std::copy_n(air, 6, params);
  } else {
    coated_conductor_fresnel(air, air + 3, e.coat_eta, params, &params[4]);
  }
}

void set_metal_alpha(const MaterialEntry& e, float* params, float alpha) {
  params[6] = coated_conductor_alpha(e.coat_eta, e.coat_alpha, alpha);
  if (e.first_row >= 0) params[8] = static_cast<float>(alpha_table(e, alpha));
}

void apply_coated_conductor_textures(const TextureTable& textures, const MaterialEntry& e,
                                     const TexturePoint& at, float* params) {
  const auto color = [&](int texture, const Rgb& constant) {
    return texture >= 0 ? textures.evaluate(texture, at) : constant;
  };
  if (e.texture_color >= 0 || e.texture_eta >= 0 || e.texture_k >= 0) {
    const Rgb first = e.conductor_reflectance ? color(e.texture_color, e.eta) : color(e.texture_eta, e.eta);
    set_coated_metal(e, params, first, color(e.texture_k, e.k));
  }
  if (e.first_row >= 0) set_metal_alpha(e, params, textured_alpha(textures, e, at));
}

}  // namespace

const CoatMemo::OverDiffuse& CoatMemo::diffuse(const CoatDescription& coat, const CoatMedium& medium,
                                               bool block) {
  const auto [at, is_new] =
      diffuse_.try_emplace({coat.eta, coat.thickness, coat.alpha, medium.albedo[0], medium.albedo[1],
                            medium.albedo[2], medium.g, block ? 1.0f : 0.0f});
  OverDiffuse& made = at->second;
  if (!is_new) return made;
  if (block) {
    const ScatteringCoat s = scattering_coat(coat, medium);
    made = {s.returned, s.entering_mean, {}};
    for (const CosineRow& row : s.entering) made.table.insert(made.table.end(), row.begin(), row.end());
    made.table.insert(made.table.end(), s.block.begin(), s.block.end());
    return made;
  }
  const bool smooth = coat.alpha <= kSmoothAlpha;
  CosineRow row;
  const CoatConstants c = smooth ? coat_constants(coat.eta, coat.thickness)
                                 : rough_coat_constants(coat.eta, coat.thickness, coat.alpha, &row);
  const double r = c.internal_reflectance;
  made = {{r, r, r}, static_cast<float>(c.entering_transmittance), {}};
  if (!smooth) made.table.assign(row.begin(), row.end());
  return made;
}

std::vector<float> CoatMemo::conductor(const CoatDescription& coat, const CoatMedium& medium,
                                       float metal_alpha, int max_depth,
                                       const std::array<float, 3>& reflectance, bool block) {
  const auto [rows, rows_are_new] = metal_rows_.try_emplace(
      {coat.eta, coat.thickness, coat.alpha, metal_alpha, static_cast<float>(max_depth)});
  if (rows_are_new) {
    for (const CosineRow& row :
         coated_conductor_rows(coat.eta, coat.thickness, coat.alpha, metal_alpha, max_depth))
      rows->second.insert(rows->second.end(), row.begin(), row.end());
  }
  std::vector<float> made = rows->second;
  if (!block) return made;
  const auto [scattered, block_is_new] = metal_blocks_.try_emplace(
      {coat.eta, coat.thickness, coat.alpha, medium.albedo[0], medium.albedo[1], medium.albedo[2], medium.g,
       metal_alpha, reflectance[0], reflectance[1], reflectance[2]});
  if (block_is_new) scattered->second = scattering_coat_over_metal(coat, medium, metal_alpha, reflectance);
  made.insert(made.end(), scattered->second.begin(), scattered->second.end());
  return made;
}

void build_coated_diffuse(const CoatedDiffuseMaterial& m, CoatMemo* coats, RenderScene* scene,
                          MaterialEntry* entry, float* params) {
  const bool smooth = set_roughness(m.roughness, entry, params), scattering = scatters(m.medium);
  const float lies = anisotropy(m.roughness);
  entry->kind = lies != 1 ? kAnisotropicCoated
                : smooth  ? (scattering ? kScatteringCoated : kSmoothCoated)
                          : (scattering ? kRoughScatteringCoated : kRoughCoated);
  entry->texture_color = m.reflectance.texture;
  entry->color = m.reflectance.value;
  entry->coat_base_encounters = (m.max_depth + 1) / 2;  // every other interaction is with the base
  params[3] = m.eta;
  params[5] = m.thickness;
  const CoatMedium medium = medium_of(m.medium);
  const auto coat = [&](float alpha) -> const CoatMemo::OverDiffuse& {
    return coats->diffuse({m.eta, m.thickness, alpha}, medium, scattering || lies != 1);
  };
  if (entry->texture_u_roughness >= 0 || entry->texture_v_roughness >= 0) {
    add_alpha_tables(scene, entry, [&](float alpha) {
      entry->coat_returned.push_back(coat(alpha).returned);
      return coat(alpha).table;
    });
    params[4] = coat(row_alpha(kAlphaRows - 1)).entering_mean;
    return;  // the rest is set at the points
  }
  const CoatMemo::OverDiffuse& made = coat(smooth ? 0 : params[6]);
  if (!made.table.empty()) {
    std::vector<float> table = made.table;
    if (lies != 1) table[3 * kCosineNodes + kCoatAnisotropy] = lies;
    params[8] = static_cast<float>(add_table(table, scene));
  }
  entry->coat_returned.assign(1, made.returned);
  params[4] = made.entering_mean;
  set_base(*entry, made.returned, m.reflectance.value, params);
}

void build_coated_conductor(const CoatedConductorMaterial& m, CoatMemo* coats, RenderScene* scene,
                            MaterialEntry* entry, float* params) {
  const Roughness& r = m.conductor.roughness;
  const bool smooth_metal = set_roughness(r, entry, params);
  const float coat_alpha =
      mean_alpha(m.coat_roughness.u.value, m.coat_roughness.v.value, m.coat_roughness.remap);
  const bool smooth_coat = coat_alpha <= kSmoothAlpha, scattering = scatters(m.medium);
  const float metal_lies = anisotropy(r), coat_lies = smooth_coat ? 1 : anisotropy(m.coat_roughness);
  const bool lies = metal_lies != 1 || coat_lies != 1;
  if (lies) {
    entry->kind = smooth_coat ? kAnisotropicCoatedConductor : kAnisotropicRoughCoatedConductor;
  } else if (scattering) {
    entry->kind = smooth_coat ? kScatteringCoatedConductor : kRoughScatteringCoatedConductor;
  } else {
    entry->kind = !smooth_coat   ? kRoughCoatedConductor
                  : smooth_metal ? kSmoothCoatedConductor
                                 : kCoatedConductor;
  }
  entry->coat_eta = m.eta;
  entry->coat_alpha = smooth_coat ? 0 : coat_alpha;
  if (m.conductor.reflectance) {
    entry->conductor_reflectance = true;
    entry->texture_color = m.conductor.reflectance->texture;
    entry->eta = m.conductor.reflectance->value;
  } else {
    entry->texture_eta = m.conductor.eta.texture;
    entry->texture_k = m.conductor.k.texture;
    entry->eta = m.conductor.eta.value;
    entry->k = m.conductor.k.value;
  }
  set_coated_metal(*entry, params, entry->eta, entry->k);
  if (entry->kind == kSmoothCoatedConductor) {
    params[7] = m.eta;
    params[8] = m.thickness;
    return;
  }
  params[3] = m.eta;
  params[5] = m.thickness;
  params[7] = std::max(coat_alpha, kSmoothAlpha);
  const std::array<float, 3> facing{params[0], params[1], params[2]};
  const auto table = [&](float metal_alpha) {
    std::vector<float> made = coats->conductor({m.eta, m.thickness, coat_alpha}, medium_of(m.medium),
                                               metal_alpha, m.max_depth, facing, scattering || lies);
    if (lies) {
      float* const block = made.data() + kReflectanceNodes * kCosineNodes;
      block[kBaseAnisotropy] = metal_lies;
      block[kCoatAnisotropy] = coat_lies;
    }
    return made;
  };
  if (r.u.texture >= 0 || r.v.texture >= 0) {
    add_alpha_tables(scene, entry, table);
  } else {
    params[8] = static_cast<float>(add_table(table(smooth_metal ? 0 : params[6]), scene));
  }
  set_metal_alpha(*entry, params, mean_alpha(r.u.value, r.v.value, r.remap));
}

bool is_coated(BsdfKind kind) {
  return kind == kSmoothCoated || kind == kRoughCoated || kind == kScatteringCoated ||
         kind == kRoughScatteringCoated || kind == kAnisotropicCoated || is_coated_conductor(kind);
}

// A diffuse base's slots depend on the roughness of its coat, too.
void apply_coat_textures(const RenderScene& scene, const MaterialEntry& e, const TexturePoint& at,
                         float* params) {
  if (is_coated_conductor(e.kind)) return apply_coated_conductor_textures(scene.textures, e, at, params);
  size_t row = 0;
  if (e.first_row >= 0) {
    const float alpha = textured_alpha(scene.textures, e, at);
    params[6] = std::max(alpha, kSmoothAlpha);
    params[8] = static_cast<float>(alpha_table(e, alpha));
    row = static_cast<size_t>(row_of_alpha(alpha));
  }
  const Rgb c = e.texture_color >= 0 ? scene.textures.evaluate(e.texture_color, at) : e.color;
  set_base(e, e.coat_returned[row], c, params);
}

}  // namespace lightmill
