#pragma once
// What several kinds of material share: how a description's numbers become parameters (slots as in bsdf.h),
// and tables over a roughness that is textured.
#include <algorithm>
#include <cmath>
#include <vector>

#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// A description's number as a reflectance.
inline float reflectance(float x) { return std::isfinite(x) ? std::clamp(x, 0.0f, 1.0f) : 0.0f; }

inline float roughness_to_alpha(float roughness, bool remap) {
  roughness = std::clamp(roughness, 0.0f, 1.0f);
  return remap ? std::sqrt(roughness) : roughness;
}

/// Isotropic alpha: the geometric mean of the two directions. Next to the delta limit in one direction the
/// lobe is kSmoothAlpha wide there.
inline float mean_alpha(float u, float v, bool remap) {
  const float au = roughness_to_alpha(u, remap), av = roughness_to_alpha(v, remap);
  return au == av ? au : std::sqrt(std::max(au, kSmoothAlpha) * std::max(av, kSmoothAlpha));
}

/// k of a conductor with eta = 1 that reflects `r` at normal incidence (pbrt's rule).
inline float k_of_reflectance(float r) {
  r = std::clamp(r, 0.0f, 0.9999f);
  return 2 * std::sqrt(r) / std::sqrt(1 - r);
}

inline void set_rgb(float* params, int slot, const Rgb& c) {
  params[slot] = c.r;
  params[slot + 1] = c.g;
  params[slot + 2] = c.b;
}

/// A part of a metal's index. Its formula squares it twice: float holds that up to 1e9, where all is
/// reflected already. Without a real part there would be no reflectance where k is 0.
inline constexpr float kLeastIndex = 1e-8f, kLargestIndex = 1e8f;
inline float index_part(float x, float least) {
  return std::isfinite(x) ? std::clamp(x, least, kLargestIndex) : least;
}
inline void set_eta(float* params, const Rgb& eta) {
  set_rgb(params, 0,
          {index_part(eta.r, kLeastIndex), index_part(eta.g, kLeastIndex), index_part(eta.b, kLeastIndex)});
}
inline void set_k(float* params, const Rgb& k) {
  set_rgb(params, 3, {index_part(k.r, 0), index_part(k.g, 0), index_part(k.b, 0)});
}

inline void set_conductor_reflectance(float* params, const Rgb& c) {
  set_rgb(params, 0, {1, 1, 1});
  set_rgb(params, 3, {k_of_reflectance(c.r), k_of_reflectance(c.g), k_of_reflectance(c.b)});
}

/// Keeps the roughness in `entry` and sets alpha in slot 6. Returns true if the lobe is its delta limit,
/// which a textured roughness never is.
inline bool set_roughness(const Roughness& r, MaterialEntry* entry, float* params) {
  entry->remap_roughness = r.remap;
  entry->u_roughness = r.u.value;
  entry->v_roughness = r.v.value;
  entry->texture_u_roughness = r.u.texture;
  entry->texture_v_roughness = r.v.texture;
  const bool textured = r.u.texture >= 0 || r.v.texture >= 0;
  params[6] = std::max(mean_alpha(r.u.value, r.v.value, r.remap), kSmoothAlpha);
  const float widest =
      std::max(roughness_to_alpha(r.u.value, r.remap), roughness_to_alpha(r.v.value, r.remap));
  return !textured && widest <= kSmoothAlpha;
}
/// Isotropic alpha of a textured point.
inline float textured_alpha(const TextureTable& textures, const MaterialEntry& e, const TexturePoint& at) {
  const auto number = [&](int texture, float constant) {
    return texture >= 0 ? textures.evaluate(texture, at).r : constant;
  };
  return mean_alpha(number(e.texture_u_roughness, e.u_roughness),
                    number(e.texture_v_roughness, e.v_roughness), e.remap_roughness);
}

// Textured roughness: rows for alphas i^2 / (kAlphaRows - 1)^2, of which the nearest is taken.
inline constexpr int kAlphaRows = 16;

inline float row_alpha(int i) {
  const float x = static_cast<float>(i) / (kAlphaRows - 1);
  return std::max(x * x, kSmoothAlpha);
}
inline int row_of_alpha(float alpha) {
  return static_cast<int>(std::sqrt(std::clamp(alpha, 0.0f, 1.0f)) * (kAlphaRows - 1) + 0.5f);
}

/// Appends `floats` to the scene's tables. Returns where they begin.
inline int add_table(const std::vector<float>& floats, RenderScene* scene) {
  const auto first = static_cast<int>(scene->bsdf_tables.size());
  scene->bsdf_tables.insert(scene->bsdf_tables.end(), floats.begin(), floats.end());
  return first;
}
/// Appends `table(alpha)`, of the same size for all, for every alpha of a textured roughness. `entry` says
/// where.
template <class Table>
void add_alpha_tables(RenderScene* scene, MaterialEntry* entry, Table&& table) {
  entry->first_row = static_cast<int>(scene->bsdf_tables.size());
  for (int i = 0; i < kAlphaRows; ++i) {
    const std::vector<float> one = table(row_alpha(i));
    entry->floats_per_alpha = static_cast<int>(one.size());
    add_table(one, scene);
  }
}
/// Where the table of `alpha` begins.
inline int alpha_table(const MaterialEntry& entry, float alpha) {
  return entry.first_row + row_of_alpha(alpha) * entry.floats_per_alpha;
}

}  // namespace lightmill
