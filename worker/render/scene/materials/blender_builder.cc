#include "worker/render/scene/materials/blender_builder.h"

#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/blender/glass.h"
#include "worker/render/bsdf/packed_params.h"
#include "worker/render/scene/materials/material_slots.h"

namespace lightmill {
namespace {

constexpr float kMostColour = 10;  // Blender does not clamp colours; more of them is a mistake

/// Values of inputs at a point, or the constants where `at` is null.
struct SocketValues {
  const TextureTable& textures;
  const TexturePoint* at;

  Rgb colour(const SpectrumInput& in) const {
    const Rgb c = at && in.texture >= 0 ? textures.evaluate(in.texture, *at) : in.value;
    const auto channel = [](float x) { return std::isfinite(x) ? std::clamp(x, 0.0f, kMostColour) : 0.0f; };
    return {channel(c.r), channel(c.g), channel(c.b)};
  }
  float number(const FloatInput& in) const {
    const float x = at && in.texture >= 0 ? textures.evaluate(in.texture, *at).r : in.value;
    return std::isfinite(x) ? x : 0.0f;
  }
  float share(const FloatInput& in) const { return std::clamp(number(in), 0.0f, 1.0f); }
};

float brightest(const Rgb& c) { return std::max({c.r, c.g, c.b}); }

/// A number of turns in [0, 1).
float within_a_turn(float turns) { return turns - std::floor(turns); }

/// An index, away from 1 where facets would not bend light.
float glass_index(float ior, bool rough) {
  ior = std::clamp(ior, 1e-2f, 1e2f);
  constexpr float kLeastBend = 1e-3f;
  if (rough && std::fabs(ior - 1) < kLeastBend) ior = ior < 1 ? 1 - kLeastBend : 1 + kLeastBend;
  return ior;
}

bool is_round(const PrincipledMaterial& m) { return m.anisotropic.texture < 0 && m.anisotropic.value <= 0; }

void set_opaque(const PrincipledMaterial& m, const SocketValues& in, float* params) {
  const Rgb base = in.colour(m.base_color);
  const float color[3] = {base.r, base.g, base.b};
  const float metallic = in.share(m.metallic), specular = in.share(m.specular),
              tint = in.share(m.specular_tint), transmission = in.share(m.transmission);
  const float diffuse = (1 - metallic) * (1 - transmission), reflects = 1 - transmission * (1 - metallic);
  const float luminance = 0.2126f * base.r + 0.7152f * base.g + 0.0722f * base.b;
  for (int c = 0; c < 3; ++c) {
    const float tinted = luminance > 0 ? 1 - tint + color[c] / luminance * tint : 1;
    params[c] = m.part == PrincipledMaterial::Part::kSurface ? 0 : color[c] * diffuse;
    params[3 + c] = reflects * (0.08f * specular * tinted * (1 - metallic) + color[c] * metallic);
  }
  // Cycles leaves out several bounces between smoother facets.
  constexpr float kLeastRoughness = 0.075f;
  const float roughness = in.share(m.roughness), anisotropic = in.share(m.anisotropic);
  const bool several = m.multi_ggx && is_round(m) && roughness > kLeastRoughness;
  params[6] = packed_pair(roughness, several ? 1 : is_round(m) ? 0 : anisotropic);
  const float lobe = specular > 0 || metallic > 0 ? reflects : 0;
  params[7] = packed_triple(specular, in.share(m.sheen_tint), lobe);
  params[8] =
      packed_triple(in.share(m.sheen) * diffuse, in.share(m.clearcoat), in.share(m.clearcoat_roughness));
  params[9] = within_a_turn(in.number(m.anisotropic_rotation));
}

/// Facets of its reflection and of what it refracts.
std::array<float, 2> glass_alphas(const PrincipledMaterial& m, const SocketValues& in) {
  const float r = in.share(m.roughness);
  const float through = m.multi_ggx ? r : 1 - (1 - r) * (1 - in.share(m.transmission_roughness));
  return {r * r, through * through};
}

void set_glass(const PrincipledMaterial& m, const SocketValues& in, bool rough, float* params) {
  params[0] = glass_index(in.number(m.ior), rough);
  set_rgb(params, 1, in.colour(m.base_color));
  params[4] = in.share(m.specular_tint);
  params[5] = kGgxFacets;
  const auto [reflecting, refracting] = glass_alphas(m, in);
  params[6] = std::max(reflecting, kSmoothAlpha);
  params[7] = std::max(refracting, kSmoothAlpha);
}

float facets_number(FacetShape shape) {
  return shape == FacetShape::kBeckmann           ? kBeckmannFacets
         : shape == FacetShape::kAshikhminShirley ? kAshikhminShirleyFacets
         : shape == FacetShape::kMultiGgx         ? kMultiGgxFacets
                                                  : kGgxFacets;
}

void set_closure(const ClosureMaterial& m, const SocketValues& in, BsdfKind kind, float* params) {
  const Rgb color = in.colour(m.color);
  const float roughness = in.share(m.roughness), alpha = std::max(roughness * roughness, kSmoothAlpha);
  switch (kind) {
    case kGlossy:
    case kAnisotropicGlossy: {
      const float a = std::clamp(in.number(m.anisotropy), -0.99f, 0.99f);
      set_rgb(params, 0, color);
      params[6] = std::max(a < 0 ? alpha / (1 + a) : alpha * (1 - a), kSmoothAlpha);
      params[8] = std::max(a < 0 ? alpha * (1 + a) : alpha / (1 - a), kSmoothAlpha);
      params[7] = facets_number(m.facets);
      params[9] = within_a_turn(in.number(m.rotation));
      return;
    }
    case kSharpGlass:
    case kRoughGlass:
      params[0] = glass_index(in.number(m.ior), kind == kRoughGlass);
      set_rgb(params, 1, color);
      params[4] = m.closure == ClosureKind::kGlass    ? kGlassOneColour
                  : m.closure == ClosureKind::kGlossy ? kGlassReflectsAlone
                                                      : kGlassRefractsAlone;
      // Several bounces in glass are left out.
      params[5] = m.facets == FacetShape::kMultiGgx ? kGgxFacets : facets_number(m.facets);
      params[6] = params[7] = alpha;
      return;
    case kDiffuseTransmission:
      set_rgb(params, 3, color);
      return;
    case kOrenNayar:
      set_rgb(params, 0, color);
      params[6] = roughness;
      return;
    case kVelvet:
      set_rgb(params, 0, color);
      params[6] = std::max(roughness, 0.01f);
      return;
    case kToon:
      set_rgb(params, 0, color);
      params[6] = std::clamp(roughness, 1e-5f, 1.0f) * kPi / 2;
      params[7] = in.share(m.anisotropy) * kPi / 2;
      params[8] = m.glossy;
      return;
    default:
      set_rgb(params, 0, m.closure == ClosureKind::kDiffuse ? color : Rgb{});
  }
}

BsdfKind kind_of(const ClosureMaterial& m) {
  const bool smooth = m.facets == FacetShape::kSharp ||
                      (m.roughness.texture < 0 && m.roughness.value * m.roughness.value <= kSmoothAlpha);
  switch (m.closure) {
    case ClosureKind::kGlossy:
      if (smooth) return kSharpGlass;
      return m.anisotropy.texture >= 0 || m.anisotropy.value != 0 ? kAnisotropicGlossy : kGlossy;
    case ClosureKind::kGlass:
    case ClosureKind::kRefraction:
      return smooth || (m.ior.texture < 0 && m.ior.value == 1) ? kSharpGlass : kRoughGlass;
    case ClosureKind::kTranslucent:
      return kDiffuseTransmission;
    case ClosureKind::kVelvet:
      return kVelvet;
    case ClosureKind::kToon:
      return kToon;
    case ClosureKind::kTransparent:
    case ClosureKind::kHoldout:
      return kDiffuse;
    case ClosureKind::kDiffuse:
      return m.roughness.texture >= 0 || m.roughness.value > 0 ? kOrenNayar : kDiffuse;
  }
  return kDiffuse;
}

/// Calls visit(texture) for the inputs of each; -1 where there is none.
template <class Visit>
void textures_of(const PrincipledMaterial& m, const Visit& visit) {
  for (const int t :
       {m.base_color.texture, m.metallic.texture, m.specular.texture, m.specular_tint.texture,
        m.roughness.texture, m.anisotropic.texture, m.anisotropic_rotation.texture, m.sheen.texture,
        m.sheen_tint.texture, m.clearcoat.texture, m.clearcoat_roughness.texture, m.ior.texture,
        m.transmission.texture, m.transmission_roughness.texture})
    visit(t);
}
template <class Visit>
void textures_of(const ClosureMaterial& m, const Visit& visit) {
  for (const int t :
       {m.color.texture, m.roughness.texture, m.anisotropy.texture, m.rotation.texture, m.ior.texture})
    visit(t);
}

bool is_principled(const MaterialEntry& entry) { return entry.principled; }

}  // namespace

void build_principled(const PrincipledMaterial& m, RenderScene* scene, MaterialEntry* entry, float* params) {
  const SocketValues in{scene->textures, nullptr};
  if (m.part == PrincipledMaterial::Part::kGlass) {
    const auto [reflecting, refracting] = glass_alphas(m, in);
    const bool smooth = m.roughness.texture < 0 && m.transmission_roughness.texture < 0 &&
                        std::max(reflecting, refracting) <= kSmoothAlpha;
    entry->kind = smooth || (m.ior.texture < 0 && m.ior.value == 1) ? kSharpGlass : kRoughGlass;
    set_glass(m, in, entry->kind == kRoughGlass, params);
    entry->brightness = 1;
  } else {
    entry->kind = is_round(m) ? kPrincipled : kAnisotropicPrincipled;
    set_opaque(m, in, params);
    entry->brightness = m.base_color.texture >= 0 ? 0.6f : brightest(m.base_color.value) + 0.1f;
  }
  entry->blender = static_cast<int>(scene->principled.size());
  entry->principled = true;
  textures_of(m, [&](int t) { entry->textured = entry->textured || t >= 0; });
  scene->principled.push_back(m);
}

void build_closure(const ClosureMaterial& m, RenderScene* scene, MaterialEntry* entry, float* params) {
  entry->kind = kind_of(m);
  set_closure(m, {scene->textures, nullptr}, entry->kind, params);
  entry->blender = static_cast<int>(scene->closures.size());
  entry->brightness = m.color.texture >= 0 ? 0.6f : brightest(m.color.value);
  if (m.closure == ClosureKind::kTransparent || m.closure == ClosureKind::kHoldout) {
    entry->brightness = 0;
    entry->passed = m.closure == ClosureKind::kTransparent;
    if (!entry->passed) std::fill_n(params, 3, kHoldoutReflectance);
  } else {
    textures_of(m, [&](int t) { entry->textured = entry->textured || t >= 0; });
  }
  scene->closures.push_back(m);
}

void apply_blender_textures(const RenderScene& scene, const MaterialEntry& entry, const TexturePoint& at,
                            float* params) {
  const SocketValues in{scene.textures, &at};
  const auto index = static_cast<size_t>(entry.blender);
  if (!is_principled(entry)) return set_closure(scene.closures[index], in, entry.kind, params);
  const PrincipledMaterial& m = scene.principled[index];
  if (m.part == PrincipledMaterial::Part::kGlass) {
    set_glass(m, in, entry.kind == kRoughGlass, params);
  } else {
    set_opaque(m, in, params);
  }
}

void visit_blender_textures(const RenderScene& scene, const MaterialEntry& entry,
                            const std::function<void(int)>& visit) {
  const auto index = static_cast<size_t>(entry.blender);
  if (is_principled(entry)) {
    textures_of(scene.principled[index], visit);
  } else {
    textures_of(scene.closures[index], visit);
  }
}

}  // namespace lightmill
