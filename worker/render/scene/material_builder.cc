#include "worker/render/scene/material_builder.h"

#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/coated_diffuse.h"
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

struct Builder {
  MaterialEntry entry;
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
    return !textured && alpha <= kSmoothAlpha;
  }

  void operator()(const DiffuseMaterial& m) {
    entry.kind = kDiffuse;
    entry.texture_color = m.reflectance.texture;
    set_reflectance(entry, params, m.reflectance.value);
  }
  void operator()(const ConductorMaterial& m) {
    entry.kind = roughness(m.roughness) ? kSmoothConductor : kRoughConductor;
    if (m.reflectance) {
      entry.conductor_reflectance = true;
      entry.texture_color = m.reflectance->texture;
      set_conductor_reflectance(params, m.reflectance->value);
    } else {
      entry.texture_eta = m.eta.texture;
      entry.texture_k = m.k.texture;
      set_rgb(params, 0, m.eta.value);
      set_rgb(params, 3, m.k.value);
    }
  }
  void operator()(const DielectricMaterial& m) {
    entry.kind = roughness(m.roughness) ? kSmoothDielectric : kRoughDielectric;
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
    const CoatConstants coat = coat_constants(m.eta, m.thickness);
    entry.coat_internal_reflectance = coat.internal_reflectance;
    entry.coat_base_encounters = (m.max_depth + 1) / 2;  // every other interaction is with the base
    params[3] = m.eta;
    params[4] = static_cast<float>(coat.entering_transmittance);
    params[5] = m.thickness;
    set_reflectance(entry, params, m.reflectance.value);
  }
};

}  // namespace

void add_material(const MaterialDescription& material, RenderScene* scene) {
  Builder b;
  std::visit(b, material.kind);
  MaterialEntry& e = b.entry;
  e.textured = e.texture_color >= 0 || e.texture_eta >= 0 || e.texture_k >= 0 || e.texture_u_roughness >= 0 ||
               e.texture_v_roughness >= 0 || e.texture_transmittance >= 0;
  e.normal_map = material.normal_map;
  e.displacement = material.displacement;
  scene->materials.push_back(e);
  scene->material_kind.push_back(e.kind);
  scene->material_params.insert(scene->material_params.end(), b.params, b.params + kBsdfParams);
}

void apply_textures(const RenderScene& scene, int32_t material, float u, float v, float* params) {
  const MaterialEntry& e = scene.materials[static_cast<size_t>(material)];
  if (e.kind == kDiffuseTransmission) {
    const Rgb r = e.texture_color >= 0 ? scene.textures.evaluate(e.texture_color, u, v) : e.color;
    const Rgb t = e.texture_transmittance >= 0 ? scene.textures.evaluate(e.texture_transmittance, u, v)
                                               : e.transmittance;
    return set_transmission(params, e.scale, r, t);
  }
  if (e.texture_color >= 0) {
    const Rgb c = scene.textures.evaluate(e.texture_color, u, v);
    if (e.conductor_reflectance) {
      set_conductor_reflectance(params, c);
    } else {
      set_reflectance(e, params, c);
    }
  }
  if (e.texture_eta >= 0) set_rgb(params, 0, scene.textures.evaluate(e.texture_eta, u, v));
  if (e.texture_k >= 0) set_rgb(params, 3, scene.textures.evaluate(e.texture_k, u, v));
  if (e.texture_u_roughness >= 0 || e.texture_v_roughness >= 0) {
    const float ru =
        e.texture_u_roughness >= 0 ? scene.textures.evaluate(e.texture_u_roughness, u, v).r : e.u_roughness;
    const float rv =
        e.texture_v_roughness >= 0 ? scene.textures.evaluate(e.texture_v_roughness, u, v).r : e.v_roughness;
    params[6] = std::max(mean_alpha(ru, rv, e.remap_roughness), kSmoothAlpha);
  }
}

}  // namespace lightmill
