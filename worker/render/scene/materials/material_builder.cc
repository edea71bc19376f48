#include "worker/render/scene/materials/material_builder.h"

#include <algorithm>

#include "worker/render/bsdf/conductor.h"
#include "worker/render/bsdf/tables/metallic_table.h"
#include "worker/render/bsdf/tables/sheen_table.h"
#include "worker/render/scene/geometry/hair_builder.h"
#include "worker/render/scene/materials/blender_builder.h"
#include "worker/render/scene/materials/coat_builder.h"
#include "worker/render/scene/materials/material_slots.h"
#include "worker/render/scene/materials/measured_builder.h"
#include "worker/render/scene/materials/metallic_builder.h"
#include "worker/render/scene/media/subsurface_builder.h"

namespace lightmill {
namespace {

void set_reflectance(const Rgb& c, float* params) {
  set_rgb(params, 0, {reflectance(c.r), reflectance(c.g), reflectance(c.b)});
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
  RenderScene* scene;
  CoatMemo* coats;
  const MaterialDescription& material;
  MaterialEntry entry = {};
  float params[kBsdfParams] = {};

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
    set_reflectance(m.reflectance.value, params);
  }
  void operator()(const ConductorMaterial& m) {
    entry.kind = set_roughness(m.roughness, &entry, params)
                     ? kSmoothConductor
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
    const auto row = [](float alpha) {
      const CosineRow made = compensation_row(alpha);
      return std::vector<float>(made.begin(), made.end());
    };
    if (m.roughness.u.texture < 0 && m.roughness.v.texture < 0) {
      params[7] = static_cast<float>(add_table(row(params[6]), scene) + 1);
    } else {
      add_alpha_tables(scene, &entry, row);
    }
  }
  void operator()(const DielectricMaterial& m) {
    // Without a change of index no facet bends light: the delta limit, however rough.
    entry.kind = set_roughness(m.roughness, &entry, params) || m.eta == 1
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
  void operator()(const CoatedDiffuseMaterial& m) { build_coated_diffuse(m, coats, scene, &entry, params); }
  void operator()(const CoatedConductorMaterial& m) {
    build_coated_conductor(m, coats, scene, &entry, params);
  }
  void operator()(const MetallicRoughnessMaterial& m) { build_metallic_roughness(m, scene, &entry, params); }
  void operator()(const TransmissionMaterial& m) { build_transmission(m, scene, &entry, params); }
  void operator()(const HairMaterial& m) { build_hair(m, &entry, params); }
  void operator()(const MeasuredMaterial& m) {
    if (m.table) entry.kind = kMeasured;  // else black
  }
  void operator()(const SubsurfaceMaterial&) { build_subsurface(material, coats, scene, &entry, params); }
  void operator()(const PrincipledMaterial& m) { build_principled(m, scene, &entry, params); }
  void operator()(const ClosureMaterial& m) { build_closure(m, scene, &entry, params); }
  void operator()(const MixMaterial& m) {
    entry.kind = kMix;
    entry.mix_first = m.materials[0];
    entry.mix_second = m.materials[1];
    entry.scale = m.amount.value;
    entry.texture_color = m.amount.texture;
    entry.mix_rule = m.rule;
    entry.mix_metallic = m.metallic;
    entry.mix_coated = m.coated;
  }
};

bool has_several_bounces(const MaterialKind& kind) {
  const auto* principled = std::get_if<PrincipledMaterial>(&kind);
  const auto* closure = std::get_if<ClosureMaterial>(&kind);
  return (principled && principled->multi_ggx) || (closure && closure->facets == FacetShape::kMultiGgx);
}

/// Puts what has a fixed place there into scene.bsdf_tables.
void begin_tables(const std::vector<MaterialDescription>& materials, RenderScene* scene) {
  const bool metallic = std::any_of(materials.begin(), materials.end(), [](const MaterialDescription& m) {
    return std::holds_alternative<MetallicRoughnessMaterial>(m.kind) ||
           std::holds_alternative<TransmissionMaterial>(m.kind) || has_several_bounces(m.kind);
  });
  if (metallic) scene->bsdf_tables = metallic_table();
  const bool sheen = std::any_of(materials.begin(), materials.end(), [](const MaterialDescription& m) {
    const auto* gltf = std::get_if<MetallicRoughnessMaterial>(&m.kind);
    return gltf && (has_sheen(*gltf) || has_film(*gltf));
  });
  if (sheen) {
    const std::vector<float>& table = sheen_table();
    scene->bsdf_tables.insert(scene->bsdf_tables.end(), table.begin(), table.end());
  }
}

void add_material(const MaterialDescription& material, CoatMemo* coats, RenderScene* scene) {
  Builder b{scene, coats, material};
  std::visit(b, material.kind);
  MaterialEntry& e = b.entry;
  e.textured = e.textured || e.texture_color >= 0 || e.texture_eta >= 0 || e.texture_k >= 0 ||
               e.texture_u_roughness >= 0 || e.texture_v_roughness >= 0 || e.texture_transmittance >= 0;
  e.normal_map = material.normal_map;
  e.displacement = material.displacement;
  e.shading_normal = material.shading_normal;
  e.tangent = material.tangent;
  e.bump_by_pixel = material.bump_by_pixel;
  e.bump_strength = material.bump_strength;
  e.opacity = material.opacity;
  e.tint = material.tint;
  e.normal_scale = material.normal_scale;
  e.normal_follows_v = material.normal_follows_v;
  scene->materials.push_back(e);
  scene->material_kind.push_back(e.kind);
  scene->material_params.insert(scene->material_params.end(), b.params, b.params + kBsdfParams);
}

/// What mixes scatter, from what their parts do; those that are defined before their parts are taken as
/// white.
void set_mix_brightness(RenderScene* scene) {
  for (MaterialEntry& e : scene->materials) {
    if (e.kind != kMix) continue;
    const auto of = [&](int part) { return scene->materials[static_cast<size_t>(part)].brightness; };
    const float first = of(e.mix_first), second = of(e.mix_second);
    const float share = e.texture_color >= 0 ? 0.5f : e.scale;
    const float both = e.mix_rule == MixRule::kAddShader ? first + second : first + (second - first) * share;
    e.brightness = e.mix_rule == MixRule::kTransmission ? 1 : both;
  }
}

}  // namespace

void add_materials(const std::vector<MaterialDescription>& materials, RenderScene* scene) {
  begin_tables(materials, scene);
  CoatMemo coats;
  for (const MaterialDescription& m : materials) add_material(m, &coats, scene);
  set_mix_brightness(scene);
  add_measured(materials, scene);  // last: where others' tables are must stay within a float's 24 bits
}

void prefetch_textures(const RenderScene& scene, const MaterialEntry& material, const TexturePoint& at) {
  const auto fetch = [&](int texture) {
    if (texture >= 0) scene.textures.prefetch(texture, at);
  };
  fetch(material.texture_color);
  fetch(material.texture_u_roughness);
  if (material.gltf < 0 || !is_metallic_roughness(material.kind)) return;
  const MetallicRoughnessMaterial& m = scene.metallic[static_cast<size_t>(material.gltf)];
  fetch(m.base_color.texture);
  fetch(m.metallic.texture);
  fetch(m.roughness.texture);
}

void apply_textures(const RenderScene& scene, int32_t material, const TexturePoint& at, float* params) {
  const MaterialEntry& e = scene.materials[static_cast<size_t>(material)];
  if (e.gltf >= 0) return apply_gltf_textures(scene, e, at, params);
  if (e.blender >= 0) return apply_blender_textures(scene, e, at, params);
  if (enters_bodies<float>(e.kind))
    return set_subsurface_reflectance(scene, scene.textures.evaluate(e.texture_color, at), params);
  if (e.kind == kHair) return set_hair_colour(e, scene.textures.evaluate(e.texture_color, at), params);
  if (e.kind == kDiffuseTransmission) {
    const Rgb r = e.texture_color >= 0 ? scene.textures.evaluate(e.texture_color, at) : e.color;
    const Rgb t =
        e.texture_transmittance >= 0 ? scene.textures.evaluate(e.texture_transmittance, at) : e.transmittance;
    return set_transmission(params, e.scale, r, t);
  }
  if (is_coated(e.kind)) return apply_coat_textures(scene, e, at, params);
  if (e.texture_color >= 0) {
    const Rgb c = scene.textures.evaluate(e.texture_color, at);
    if (e.conductor_reflectance) {
      set_conductor_reflectance(params, c);
    } else {
      set_reflectance(c, params);
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
      params[7] = static_cast<float>(alpha_table(e, params[6]) + 1);
  }
}

}  // namespace lightmill
