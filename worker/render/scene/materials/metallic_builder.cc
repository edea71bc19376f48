#include "worker/render/scene/materials/metallic_builder.h"

#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/brushed.h"
#include "worker/render/bsdf/packed_params.h"
#include "worker/render/bsdf/translucent.h"
#include "worker/render/math/angle.h"
#include "worker/render/scene/materials/material_slots.h"

namespace lightmill {
namespace {

/// Values of inputs at a point, or the constants where `at` is null.
struct Inputs {
  const TextureTable& textures;
  const TexturePoint* at;

  Rgb operator()(const SpectrumInput& in) const {
    return at && in.texture >= 0 ? textures.evaluate(in.texture, *at) : in.value;
  }
  float operator()(const FloatInput& in) const {
    const float x = at && in.texture >= 0 ? textures.evaluate(in.texture, *at).r : in.value;
    return std::isfinite(x) ? std::clamp(x, 0.0f, 1.0f) : 0.0f;
  }
};

float within_unit(float x) { return std::isfinite(x) ? std::clamp(x, 0.0f, 1.0f) : 0.0f; }

float gltf_alpha(float roughness) { return std::max(roughness * roughness, kSmoothAlpha); }

void set_metallic_roughness(const MetallicRoughnessMaterial& m, const Inputs& value, const float* table,
                            float* params, bool sheen) {
  const Rgb base = value(m.base_color), tint = value(m.specular_color);
  const float metallic = value(m.metallic), specular = value(m.specular);
  const float ratio = m.ior == 0 ? 1 : (m.ior - 1) / (m.ior + 1);
  const float color[3] = {within_unit(base.r), within_unit(base.g), within_unit(base.b)};
  const float of_specular[3] = {tint.r, tint.g, tint.b};
  const float alpha = gltf_alpha(value(m.roughness));
  float brightest = 0;
  for (int c = 0; c < 3; ++c) {
    const float f0 = within_unit(ratio * ratio * of_specular[c]) * specular;
    brightest = std::max(brightest, f0);
    params[3 + c] = f0 + (color[c] - f0) * metallic;
  }
  params[6] = alpha;
  params[7] = specular + (1 - specular) * metallic;
  params[8] = brightest;
  const float left = std::max(1 - mean_lobe_albedo(table, alpha, brightest, params[7]), 1e-6f);
  for (int c = 0; c < 3; ++c) params[c] = color[c] * (1 - metallic) / left;
  // Not above 0.999: 1 would be the next step of the weight.
  params[9] = coat_slot(value(m.clearcoat), std::min(gltf_alpha(value(m.clearcoat_roughness)), 0.999f));
  if (!sheen) return;
  const Rgb fibres = value(m.sheen_color);
  params[6] = sheen_alpha_slot(value(m.sheen_roughness), std::min(alpha, 0.999f));
  params[7] = packed_pair(params[7], brightest);
  params[8] = packed_color(within_unit(fibres.r), within_unit(fibres.g), within_unit(fibres.b));
}

/// Slots of iridescence.h, beside those that set_metallic_roughness set with sheen.
void set_iridescence(const MetallicRoughnessMaterial& m, const Inputs& value, int block, float* params) {
  const Rgb base = value(m.base_color), tint = value(m.specular_color);
  const float metallic = value(m.metallic), specular = value(m.specular);
  const float ratio = m.ior == 0 ? 1 : (m.ior - 1) / (m.ior + 1);
  const auto f0 = [&](float x) { return within_unit(ratio * ratio * x) * specular; };
  set_rgb(params, 0, {within_unit(base.r), within_unit(base.g), within_unit(base.b)});
  params[3] = packed_color(f0(tint.r), f0(tint.g), f0(tint.b));
  const int place = block / kFilmAlign;  // without a remainder
  params[4] = static_cast<float>(place);
  params[5] = packed_pair(value(m.iridescence_thickness), value(m.iridescence));
  params[7] = packed_pair(specular, metallic);
}

/// Slots of brushed.h, from those of metallic_roughness.h.
void set_anisotropy(const MetallicRoughnessMaterial& m, const Inputs& value, const float* table,
                    float* params) {
  float strength = m.anisotropy, direction = m.anisotropy_rotation;
  if (m.anisotropy_texture >= 0 && value.at) {
    const Rgb map = value.textures.evaluate(m.anisotropy_texture, *value.at);
    strength *= within_unit(map.b);
    direction += turns(2 * map.g - 1, 2 * map.r - 1);
  }
  const float f90 = params[7], brightest = params[8], alpha = params[6];
  const float wide = alpha + (1 - alpha) * strength * strength;
  // 1 - mean E of the larger of both.
  const auto left = [&](float a) { return std::max(1 - mean_lobe_albedo(table, a, brightest, f90), 1e-6f); };
  const float scale = left(alpha) / std::min(left(alpha), left(wide));
  for (int c = 0; c < 3; ++c) params[c] *= scale;
  params[3] = packed_pair(params[3], params[4]);
  params[4] = packed_pair(params[5], f90);
  params[5] = params[9];
  params[6] = wide;
  params[7] = brightest;
  params[8] = alpha;
  params[9] = direction - std::floor(direction);
}

/// Slots of translucent.h, from those of metallic_roughness.h.
void set_translucence(const MetallicRoughnessMaterial& m, const Inputs& value, const float* table,
                      float* params) {
  const float share = value(m.translucence), f90 = params[7], alpha = std::min(params[6], 0.999f);
  const float brightest = stored_brightest(std::min(params[8], 1.0f));
  // (1 - metallic) / (1 - mean E) of what is stored.
  const float scale =
      (1 - value(m.metallic)) / std::max(1 - mean_lobe_albedo(table, alpha, brightest, f90), 1e-6f);
  const Rgb color = value(m.base_color), through = value(m.translucent_color);
  const auto base = [&](float c, float of) { return within_unit(c) * scale * of; };
  params[3] = packed_pair(params[3], params[4]);
  params[4] = packed_pair(params[5], f90);
  params[5] = params[9];
  params[6] = brightest * kBrightestSteps + alpha;
  set_rgb(params, 0, {base(color.r, 1 - share), base(color.g, 1 - share), base(color.b, 1 - share)});
  set_rgb(params, 7, {base(through.r, share), base(through.g, share), base(through.b, share)});
}

/// The film over all that the material's dielectric may be.
FilmOnBase film_on(const MetallicRoughnessMaterial& m) {
  FilmOnBase film{m.iridescence_ior, m.iridescence_nm[0], m.iridescence_nm[1], {}};
  // Without a texture it is as thick everywhere.
  if (m.iridescence_thickness.texture < 0) film.thickness_from = film.thickness_to;
  const float ratio = m.ior == 0 ? 1 : (m.ior - 1) / (m.ior + 1);
  const bool textured = m.specular.texture >= 0 || m.specular_color.texture >= 0;
  for (const float scale : {1.0f, 0.75f, 0.5f, 0.25f, 0.0f}) {
    const float specular = within_unit(m.specular.value) * scale;
    const auto f0 = [&](float x) { return within_unit(ratio * ratio * x) * specular; };
    const Rgb& tint = m.specular_color.value;
    film.bases.push_back({{f0(tint.r), f0(tint.g), f0(tint.b)}, specular});
    if (!textured) break;
  }
  return film;
}

/// Where the block of `m`'s film is: a new one, or that of an earlier material of the same film.
int film_block_of(const MetallicRoughnessMaterial& m, RenderScene* scene) {
  const FilmOnBase film = film_on(m);
  for (const MaterialEntry& e : scene->materials) {
    if (e.kind == kIridescent && film_on(scene->metallic[static_cast<size_t>(e.gltf)]) == film)
      return e.first_row;
  }
  const size_t size = scene->bsdf_tables.size();
  scene->bsdf_tables.resize((size + kFilmAlign - 1) / kFilmAlign * kFilmAlign);
  return add_table(film_block(film), scene);
}

void set_transmission_tint(const TransmissionMaterial& m, const Inputs& value, float* params) {
  const Rgb tint = value(m.color);
  params[0] = m.ior;
  params[1] = within_unit(tint.r);
  params[2] = within_unit(tint.g);
  params[3] = within_unit(tint.b);
  params[6] = gltf_alpha(value(m.roughness));
}

}  // namespace

bool has_sheen(const MetallicRoughnessMaterial& m) {
  const Rgb& c = m.sheen_color.value;
  return m.sheen_color.texture >= 0 || c.r > 0 || c.g > 0 || c.b > 0;
}

bool has_translucence(const MetallicRoughnessMaterial& m) {
  return m.translucence.texture >= 0 || m.translucence.value > 0;
}

bool has_film(const MetallicRoughnessMaterial& m) {
  return m.iridescence.texture >= 0 || m.iridescence.value > 0;
}

void build_metallic_roughness(const MetallicRoughnessMaterial& m, RenderScene* scene, MaterialEntry* entry,
                              float* params) {
  const bool coated = m.clearcoat.texture >= 0 || m.clearcoat.value > 0;
  const bool film = has_film(m), sheen = film || has_sheen(m);
  entry->kind = film                  ? kIridescent
                : m.anisotropy > 0    ? kAnisotropicMetallicRoughness
                : has_translucence(m) ? kTranslucent
                : sheen               ? kSheenMetallicRoughness
                : coated              ? kCoatedMetallicRoughness
                                      : kMetallicRoughness;
  entry->gltf = static_cast<int>(scene->metallic.size());
  for (const int t :
       {m.base_color.texture, m.metallic.texture, m.roughness.texture, m.specular.texture,
        m.specular_color.texture, m.clearcoat.texture, m.clearcoat_roughness.texture, m.sheen_color.texture,
        m.sheen_roughness.texture, m.iridescence.texture, m.iridescence_thickness.texture,
        m.anisotropy_texture, m.translucence.texture, m.translucent_color.texture})
    entry->textured = entry->textured || t >= 0;
  scene->metallic.push_back(m);
  if (film) entry->first_row = film_block_of(m, scene);
  set_metallic_roughness(m, {scene->textures, nullptr}, scene->bsdf_tables.data(), params, sheen);
  if (film) set_iridescence(m, {scene->textures, nullptr}, entry->first_row, params);
  if (entry->kind == kAnisotropicMetallicRoughness)
    set_anisotropy(m, {scene->textures, nullptr}, scene->bsdf_tables.data(), params);
  if (entry->kind == kTranslucent)
    set_translucence(m, {scene->textures, nullptr}, scene->bsdf_tables.data(), params);
}

void build_transmission(const TransmissionMaterial& m, RenderScene* scene, MaterialEntry* entry,
                        float* params) {
  // A solid that does not bend light passes it straight on, however rough; a sheet spreads it by itself.
  const bool smooth = (!m.thin && m.ior == 1) ||
                      (m.roughness.texture < 0 &&
                       within_unit(m.roughness.value) * within_unit(m.roughness.value) <= kSmoothAlpha);
  entry->kind = m.thin ? (smooth ? kTintedSheet : kRoughTintedSheet)
                       : (smooth ? kTintedDielectric : kRoughTintedDielectric);
  entry->gltf = static_cast<int>(scene->tinted.size());
  entry->textured = m.color.texture >= 0 || m.roughness.texture >= 0;
  scene->tinted.push_back(m);
  set_transmission_tint(m, {scene->textures, nullptr}, params);
}

void apply_gltf_textures(const RenderScene& scene, const MaterialEntry& entry, const TexturePoint& at,
                         float* params) {
  const Inputs value{scene.textures, &at};
  const auto index = static_cast<size_t>(entry.gltf);
  const bool film = entry.kind == kIridescent, sheen = film || entry.kind == kSheenMetallicRoughness;
  const bool brushed = entry.kind == kAnisotropicMetallicRoughness;
  const bool translucent = entry.kind == kTranslucent;
  if (is_metallic_roughness(entry.kind)) {
    set_metallic_roughness(scene.metallic[index], value, scene.bsdf_tables.data(), params, sheen);
    if (film) set_iridescence(scene.metallic[index], value, entry.first_row, params);
    if (brushed) set_anisotropy(scene.metallic[index], value, scene.bsdf_tables.data(), params);
    if (translucent) set_translucence(scene.metallic[index], value, scene.bsdf_tables.data(), params);
  } else {
    set_transmission_tint(scene.tinted[index], value, params);
  }
}

}  // namespace lightmill
