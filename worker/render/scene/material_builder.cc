#include "worker/render/scene/material_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "worker/render/bsdf/coated_conductor.h"
#include "worker/render/bsdf/coated_diffuse.h"
#include "worker/render/bsdf/conductor.h"
#include "worker/render/bsdf/metallic_table.h"
#include "worker/render/bsdf/sheen_table.h"
#include "worker/render/scene/hair_builder.h"
#include "worker/render/scene/metallic_builder.h"
#include "worker/render/scene/surface.h"

namespace lightmill {
namespace {

float reflectance(float x) { return std::isfinite(x) ? std::clamp(x, 0.0f, 1.0f) : 0.0f; }

float roughness_to_alpha(float roughness, bool remap) {
  roughness = std::clamp(roughness, 0.0f, 1.0f);
  return remap ? std::sqrt(roughness) : roughness;
}

/// Isotropic alpha: the geometric mean of the two directions.
float mean_alpha(float u, float v, bool remap) {
  const float au = roughness_to_alpha(u, remap), av = roughness_to_alpha(v, remap);
  return au == av ? au : std::sqrt(au * av);
}

/// k of a conductor with eta = 1 that reflects `r` at normal incidence (pbrt's rule).
float k_of_reflectance(float r) {
  r = std::clamp(r, 0.0f, 0.9999f);
  return 2 * std::sqrt(r) / std::sqrt(1 - r);
}

void set_rgb(float* params, int slot, const Rgb& c) {
  params[slot] = c.r;
  params[slot + 1] = c.g;
  params[slot + 2] = c.b;
}

/// A metal's index. Its formula squares it twice, so that float holds it up to 1e9, where all is reflected
/// already; and without a real part there is no reflectance where k is 0.
constexpr float kLeastIndex = 1e-8f, kLargestIndex = 1e8f;
float index_part(float x, float least) {
  return std::isfinite(x) ? std::clamp(x, least, kLargestIndex) : least;
}
void set_eta(float* params, const Rgb& eta) {
  set_rgb(params, 0,
          {index_part(eta.r, kLeastIndex), index_part(eta.g, kLeastIndex), index_part(eta.b, kLeastIndex)});
}
void set_k(float* params, const Rgb& k) {
  set_rgb(params, 3, {index_part(k.r, 0), index_part(k.g, 0), index_part(k.b, 0)});
}

void set_reflectance(const MaterialEntry& entry, float* params, const Rgb& c) {
  Rgb rho = {reflectance(c.r), reflectance(c.g), reflectance(c.b)};
  if (entry.kind == kSmoothCoated || entry.kind == kRoughCoated) {
    const auto base = [&](float x) {
      return coated_base(x, params[3], entry.coat_internal_reflectance, entry.coat_base_encounters);
    };
    rho = {base(rho.r), base(rho.g), base(rho.b)};
  }
  set_rgb(params, 0, rho);
}

void set_conductor_reflectance(float* params, const Rgb& c) {
  set_rgb(params, 0, {1, 1, 1});
  set_rgb(params, 3, {k_of_reflectance(c.r), k_of_reflectance(c.g), k_of_reflectance(c.b)});
}

/// Slots 0-5 of diffuse transmission, no channel above a sum of 1.
void set_transmission(float* params, float scale, const Rgb& r, const Rgb& t) {
  const float from[6] = {r.r, r.g, r.b, t.r, t.g, t.b};
  for (int c = 0; c < 3; ++c) {
    const float a = reflectance(scale * from[c]), b = reflectance(scale * from[c + 3]);
    const float k = 1 / std::max(a + b, 1.0f);
    params[c] = a * k;
    params[c + 3] = b * k;
  }
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

// Textured roughness: rows for alphas i^2 / (kAlphaRows - 1)^2, of which the nearest is taken.
constexpr int kAlphaRows = 16;

float row_alpha(int i) {
  const float x = static_cast<float>(i) / (kAlphaRows - 1);
  return std::max(x * x, kSmoothAlpha);
}
int row_of_alpha(float alpha) {
  return static_cast<int>(std::sqrt(std::clamp(alpha, 0.0f, 1.0f)) * (kAlphaRows - 1) + 0.5f);
}

/// Appends rows to the scene's tables; returns where they begin.
template <size_t kRows>
int add_rows(const std::array<CosineRow, kRows>& rows, RenderScene* scene) {
  const auto first = static_cast<int>(scene->bsdf_tables.size());
  for (const CosineRow& row : rows)
    scene->bsdf_tables.insert(scene->bsdf_tables.end(), row.begin(), row.end());
  return first;
}

/// Appends `rows(alpha)` for every alpha of a textured roughness; returns where they begin.
template <class Rows>
int add_alpha_rows(RenderScene* scene, Rows&& rows) {
  const auto first = static_cast<int>(scene->bsdf_tables.size());
  for (int i = 0; i < kAlphaRows; ++i) add_rows(rows(row_alpha(i)), scene);
  return first;
}

/// What depends on the roughness of a rough coat over a diffuse base, but not yet its colour.
void set_rough_coat(MaterialEntry& e, float* params, float alpha) {
  params[6] = std::max(alpha, kSmoothAlpha);
  if (e.first_row < 0) return;
  const int i = row_of_alpha(alpha);
  params[8] = static_cast<float>(e.first_row + i * kCosineNodes);
  e.coat_internal_reflectance = e.coat_returns[static_cast<size_t>(i)];
}

void set_metal_alpha(const MaterialEntry& e, float* params, float alpha) {
  params[6] = coated_conductor_alpha(e.coat_eta, e.coat_alpha, alpha);
  if (e.first_row >= 0)
    params[8] = static_cast<float>(e.first_row + row_of_alpha(alpha) * kReflectanceNodes * kCosineNodes);
}

/// What has been computed for the coats of one scene: many materials share theirs.
struct CoatMemo {
  struct OverDiffuse {
    CoatConstants constants;
    CosineRow row;
  };
  using OverConductor = std::array<CosineRow, kReflectanceNodes>;
  std::map<std::array<float, 3>, OverDiffuse> over_diffuse;      // by eta, thickness, alpha
  std::map<std::array<float, 5>, OverConductor> over_conductor;  // and the metal's alpha, max_depth

  const OverDiffuse& diffuse(float eta, float thickness, float alpha) {
    const auto [at, is_new] = over_diffuse.try_emplace({eta, thickness, alpha});
    if (is_new) at->second.constants = rough_coat_constants(eta, thickness, alpha, &at->second.row);
    return at->second;
  }
  const OverConductor& conductor(float eta, float thickness, float alpha, float metal_alpha, int max_depth) {
    const auto [at, is_new] =
        over_conductor.try_emplace({eta, thickness, alpha, metal_alpha, static_cast<float>(max_depth)});
    if (is_new) at->second = coated_conductor_rows(eta, thickness, alpha, metal_alpha, max_depth);
    return at->second;
  }
};

struct Builder {
  RenderScene* scene;
  CoatMemo* coats;
  MaterialEntry entry = {};
  float params[kBsdfParams] = {};

  /// Sets alpha and returns true if the lobe is its delta limit. Textured roughness never is.
  bool roughness(const Roughness& r) {
    entry.remap_roughness = r.remap;
    entry.u_roughness = r.u.value;
    entry.v_roughness = r.v.value;
    entry.texture_u_roughness = r.u.texture;
    entry.texture_v_roughness = r.v.texture;
    const bool textured = r.u.texture >= 0 || r.v.texture >= 0;
    const float alpha = mean_alpha(r.u.value, r.v.value, r.remap);
    params[6] = std::max(alpha, kSmoothAlpha);
    const float widest =
        std::max(roughness_to_alpha(r.u.value, r.remap), roughness_to_alpha(r.v.value, r.remap));
    return !textured && widest <= kSmoothAlpha;
  }
  /// `isotropic` or, if the roughness differs by direction, the anisotropic kind with its parameters. Next to
  /// the delta limit in one direction the lobe is kSmoothAlpha wide there.
  BsdfKind along_tangent(const Roughness& r, BsdfKind isotropic, BsdfKind anisotropic) {
    if (r.u.texture == r.v.texture && (r.u.texture >= 0 || r.u.value == r.v.value)) return isotropic;
    params[6] = std::max(roughness_to_alpha(r.u.value, r.remap), kSmoothAlpha);
    params[8] = std::max(roughness_to_alpha(r.v.value, r.remap), kSmoothAlpha);
    return anisotropic;
  }

  void operator()(const DiffuseMaterial& m) {
    entry.kind = kDiffuse;
    entry.texture_color = m.reflectance.texture;
    set_reflectance(entry, params, m.reflectance.value);
  }
  void operator()(const ConductorMaterial& m) {
    entry.kind = roughness(m.roughness) ? kSmoothConductor
                                        : along_tangent(m.roughness, kRoughConductor, kAnisotropicConductor);
    if (m.reflectance) {
      entry.conductor_reflectance = true;
      entry.texture_color = m.reflectance->texture;
      set_conductor_reflectance(params, m.reflectance->value);
    } else {
      entry.texture_eta = m.eta.texture;
      entry.texture_k = m.k.texture;
      set_eta(params, m.eta.value);
      set_k(params, m.k.value);
    }
    if (entry.kind != kRoughConductor || !scene->energy_compensation) return;
    const auto row = [](float alpha) { return std::array<CosineRow, 1>{compensation_row(alpha)}; };
    if (m.roughness.u.texture < 0 && m.roughness.v.texture < 0) {
      params[7] = static_cast<float>(add_rows(row(params[6]), scene) + 1);
    } else {
      entry.first_row = add_alpha_rows(scene, row);
    }
  }
  void operator()(const DielectricMaterial& m) {
    // Without a change of index no facet bends light: the delta limit, however rough.
    entry.kind = roughness(m.roughness) || m.eta == 1
                     ? kSmoothDielectric
                     : along_tangent(m.roughness, kRoughDielectric, kAnisotropicDielectric);
    params[0] = m.eta;
  }
  void operator()(const ThinDielectricMaterial& m) {
    entry.kind = kThinDielectric;
    params[0] = m.eta;
  }
  void operator()(const DiffuseTransmissionMaterial& m) {
    entry.kind = kDiffuseTransmission;
    entry.texture_color = m.reflectance.texture;
    entry.texture_transmittance = m.transmittance.texture;
    entry.color = m.reflectance.value;
    entry.transmittance = m.transmittance.value;
    entry.scale = m.scale;
    set_transmission(params, m.scale, entry.color, entry.transmittance);
  }
  void operator()(const CoatedDiffuseMaterial& m) {
    entry.kind = roughness(m.roughness) ? kSmoothCoated : kRoughCoated;
    entry.texture_color = m.reflectance.texture;
    entry.color = m.reflectance.value;
    entry.coat_base_encounters = (m.max_depth + 1) / 2;  // every other interaction is with the base
    params[3] = m.eta;
    params[5] = m.thickness;
    const bool textured = entry.texture_u_roughness >= 0 || entry.texture_v_roughness >= 0;
    CoatConstants coat = coat_constants(m.eta, m.thickness);
    const auto rough_coat = [&](float alpha) {
      const CoatMemo::OverDiffuse& known = coats->diffuse(m.eta, m.thickness, alpha);
      coat = known.constants;
      return std::array<CosineRow, 1>{known.row};
    };
    if (textured) {
      entry.first_row = add_alpha_rows(scene, [&](float alpha) {
        const auto row = rough_coat(alpha);
        entry.coat_returns.push_back(coat.internal_reflectance);
        return row;
      });
    } else if (entry.kind == kRoughCoated) {
      params[8] = static_cast<float>(add_rows(rough_coat(params[6]), scene));
    }
    entry.coat_internal_reflectance = coat.internal_reflectance;
    params[4] = static_cast<float>(coat.entering_transmittance);
    set_reflectance(entry, params, m.reflectance.value);
  }
  void operator()(const MetallicRoughnessMaterial& m) { build_metallic_roughness(m, scene, &entry, params); }
  void operator()(const TransmissionMaterial& m) { build_transmission(m, scene, &entry, params); }
  void operator()(const HairMaterial& m) { build_hair(m, &entry, params); }
  void operator()(const MixMaterial& m) {
    entry.kind = kMix;
    entry.mix_first = m.materials[0];
    entry.mix_second = m.materials[1];
    entry.scale = m.amount.value;
    entry.texture_color = m.amount.texture;
  }
  void operator()(const CoatedConductorMaterial& m) {
    const bool smooth_metal = roughness(m.conductor.roughness);
    const float coat_alpha =
        mean_alpha(m.coat_roughness.u.value, m.coat_roughness.v.value, m.coat_roughness.remap);
    const bool smooth_coat = coat_alpha <= kSmoothAlpha;
    entry.kind = !smooth_coat   ? kRoughCoatedConductor
                 : smooth_metal ? kSmoothCoatedConductor
                                : kCoatedConductor;
    entry.coat_eta = m.eta;
    entry.coat_alpha = smooth_coat ? 0 : coat_alpha;
    if (m.conductor.reflectance) {
      entry.conductor_reflectance = true;
      entry.texture_color = m.conductor.reflectance->texture;
      entry.eta = m.conductor.reflectance->value;
    } else {
      entry.texture_eta = m.conductor.eta.texture;
      entry.texture_k = m.conductor.k.texture;
      entry.eta = m.conductor.eta.value;
      entry.k = m.conductor.k.value;
    }
    set_coated_metal(entry, params, entry.eta, entry.k);
    if (entry.kind == kSmoothCoatedConductor) {
      params[7] = m.eta;
      params[8] = m.thickness;
      return;
    }
    params[3] = m.eta;
    params[5] = m.thickness;
    params[7] = std::max(coat_alpha, kSmoothAlpha);
    const auto rows = [&](float metal_alpha) {
      return coats->conductor(m.eta, m.thickness, coat_alpha, metal_alpha, m.max_depth);
    };
    const Roughness& r = m.conductor.roughness;
    if (r.u.texture >= 0 || r.v.texture >= 0) {
      entry.first_row = add_alpha_rows(scene, rows);
    } else {
      params[8] = static_cast<float>(add_rows(rows(smooth_metal ? 0 : params[6]), scene));
    }
    set_metal_alpha(entry, params, mean_alpha(r.u.value, r.v.value, r.remap));
  }
};

/// Puts what has a fixed place there into scene.bsdf_tables.
void begin_tables(const std::vector<MaterialDescription>& materials, RenderScene* scene) {
  const bool metallic = std::any_of(materials.begin(), materials.end(), [](const MaterialDescription& m) {
    return std::holds_alternative<MetallicRoughnessMaterial>(m.kind) ||
           std::holds_alternative<TransmissionMaterial>(m.kind);
  });
  if (metallic) scene->bsdf_tables = metallic_table();
  const bool sheen = std::any_of(materials.begin(), materials.end(), [](const MaterialDescription& m) {
    const auto* gltf = std::get_if<MetallicRoughnessMaterial>(&m.kind);
    return gltf && has_sheen(*gltf);
  });
  if (sheen) {
    const std::vector<float>& table = sheen_table();
    scene->bsdf_tables.insert(scene->bsdf_tables.end(), table.begin(), table.end());
  }
}

void add_material(const MaterialDescription& material, CoatMemo* coats, RenderScene* scene) {
  Builder b{scene, coats};
  std::visit(b, material.kind);
  MaterialEntry& e = b.entry;
  e.textured = e.textured || e.texture_color >= 0 || e.texture_eta >= 0 || e.texture_k >= 0 ||
               e.texture_u_roughness >= 0 || e.texture_v_roughness >= 0 || e.texture_transmittance >= 0;
  e.normal_map = material.normal_map;
  e.displacement = material.displacement;
  e.normal_scale = material.normal_scale;
  e.normal_follows_v = material.normal_follows_v;
  scene->materials.push_back(e);
  scene->material_kind.push_back(e.kind);
  scene->material_params.insert(scene->material_params.end(), b.params, b.params + kBsdfParams);
}

}  // namespace

void add_materials(const std::vector<MaterialDescription>& materials, RenderScene* scene) {
  begin_tables(materials, scene);
  CoatMemo coats;
  for (const MaterialDescription& m : materials) add_material(m, &coats, scene);
}

namespace {

float textured_alpha(const TextureTable& textures, const MaterialEntry& e, const TexturePoint& at) {
  const auto number = [&](int texture, float constant) {
    return texture >= 0 ? textures.evaluate(texture, at).r : constant;
  };
  return mean_alpha(number(e.texture_u_roughness, e.u_roughness),
                    number(e.texture_v_roughness, e.v_roughness), e.remap_roughness);
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

/// A diffuse base under a coat of textured roughness: its colour depends on the roughness, too.
void apply_rough_coat_textures(const TextureTable& textures, const MaterialEntry& entry,
                               const TexturePoint& at, float* params) {
  MaterialEntry e = entry;
  set_rough_coat(e, params, textured_alpha(textures, e, at));
  set_reflectance(e, params, e.texture_color >= 0 ? textures.evaluate(e.texture_color, at) : e.color);
}

}  // namespace

void apply_textures(const RenderScene& scene, int32_t material, const TexturePoint& at, float* params) {
  const MaterialEntry& e = scene.materials[static_cast<size_t>(material)];
  if (e.gltf >= 0) return apply_gltf_textures(scene, e, at, params);
  if (e.kind == kHair) return set_hair_colour(e, scene.textures.evaluate(e.texture_color, at), params);
  if (e.kind == kDiffuseTransmission) {
    const Rgb r = e.texture_color >= 0 ? scene.textures.evaluate(e.texture_color, at) : e.color;
    const Rgb t =
        e.texture_transmittance >= 0 ? scene.textures.evaluate(e.texture_transmittance, at) : e.transmittance;
    return set_transmission(params, e.scale, r, t);
  }
  if (e.kind == kSmoothCoatedConductor || e.kind == kCoatedConductor || e.kind == kRoughCoatedConductor)
    return apply_coated_conductor_textures(scene.textures, e, at, params);
  if (e.kind == kRoughCoated && e.first_row >= 0)
    return apply_rough_coat_textures(scene.textures, e, at, params);
  if (e.texture_color >= 0) {
    const Rgb c = scene.textures.evaluate(e.texture_color, at);
    if (e.conductor_reflectance) {
      set_conductor_reflectance(params, c);
    } else {
      set_reflectance(e, params, c);
    }
  }
  if (e.texture_eta >= 0) set_eta(params, scene.textures.evaluate(e.texture_eta, at));
  if (e.texture_k >= 0) set_k(params, scene.textures.evaluate(e.texture_k, at));
  if ((e.texture_u_roughness >= 0 || e.texture_v_roughness >= 0) && anisotropic<float>(e.kind)) {
    const auto alpha = [&](int texture, float constant) {
      const float r = texture >= 0 ? scene.textures.evaluate(texture, at).r : constant;
      return std::max(roughness_to_alpha(r, e.remap_roughness), kSmoothAlpha);
    };
    params[6] = alpha(e.texture_u_roughness, e.u_roughness);
    params[8] = alpha(e.texture_v_roughness, e.v_roughness);
  } else if (e.texture_u_roughness >= 0 || e.texture_v_roughness >= 0) {
    params[6] = std::max(textured_alpha(scene.textures, e, at), kSmoothAlpha);
    if (e.kind == kRoughConductor && e.first_row >= 0)
      params[7] = static_cast<float>(e.first_row + row_of_alpha(params[6]) * kCosineNodes + 1);
  }
}

}  // namespace lightmill
