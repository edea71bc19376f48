#include "tests/worker/render/bsdf/bsdf_cases.h"

#include <cmath>
#include <stdexcept>

#include "tests/support/measured_file.h"
#include "tests/support/test_scene.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill::test {

std::vector<BsdfCase> all_bsdfs() {
  TestScene s;
  std::vector<BsdfCase> cases;
  auto add = [&](std::string name, int, float alpha) { cases.push_back({std::move(name), 0, {}, alpha}); };
  const Rgb colour{0.8f, 0.5f, 0.1f}, white{1, 1, 1};
  add("diffuse", s.diffuse(colour), 0);
  add("diffuse_white", s.diffuse(white), 0);
  add("conductor_smooth", s.conductor(0.9f, 0), 0);
  for (const float a : {0.05f, 0.2f, 0.5f, 1.0f})
    add("conductor_" + std::to_string(a), s.conductor(0.9f, a), a);
  add("dielectric_smooth", s.dielectric(1.5f, 0), 0);
  for (const float a : {0.05f, 0.2f, 0.5f}) add("dielectric_" + std::to_string(a), s.dielectric(1.5f, a), a);
  add("dielectric_water", s.dielectric(1.33f, 0.3f), 0.3f);
  add("dielectric_thin", s.dielectric(0.75f, 0.3f), 0.3f);
  add("coated_smooth", s.coated(colour, 1.5f, 0), 0);
  add("coated_white", s.coated(white, 1.5f, 0), 0);
  for (const float a : {0.05f, 0.3f}) add("coated_" + std::to_string(a), s.coated(colour, 1.5f, a), a);
  add("coated_white_rough", s.coated(white, 1.8f, 0.4f), 0.4f);
  for (const float eta : {1.0f, 1.5f, 2.4f, 0.75f})
    add("thin_sheet_" + std::to_string(eta), s.thin_dielectric(eta), 0);
  const Rgb black{};
  add("sheet_colour", s.diffuse_transmission({0.1f, 0.4f, 0.2f}, {0.6f, 0.3f, 0.1f}), 0);
  add("sheet_lossless", s.diffuse_transmission({0.3f, 0.3f, 0.3f}, {0.7f, 0.7f, 0.7f}), 0);
  add("sheet_transmits", s.diffuse_transmission(black, white), 0);
  add("sheet_reflects", s.diffuse_transmission(white, black), 0);
  add("sheet_above_one", s.diffuse_transmission(white, white), 0);
  const Rgb gold{0.9f, 0.7f, 0.3f};
  add("lacquer_smooth", s.coated_conductor(gold, 1.5f, 0, 0), 0);
  for (const float a : {0.05f, 0.3f, 1.0f})
    add("lacquer_metal_" + std::to_string(a), s.coated_conductor(gold, 1.5f, 0, a), a);
  add("lacquer_white", s.coated_conductor(white, 1.8f, 0, 0.4f), 0.4f);
  add("lacquer_coat", s.coated_conductor(gold, 1.5f, 0.3f, 0), 0.05f);
  add("lacquer_both", s.coated_conductor(gold, 1.5f, 0.2f, 0.3f), 0.2f);
  add("lacquer_dense", s.coated_conductor(white, 2.5f, 0.5f, 0.5f), 0.5f);
  const auto brushed = [&](int material, float u, float v) {
    Roughness& r = std::visit(
        [](auto& m) -> Roughness& {
          if constexpr (requires { m.roughness.remap; }) {
            return m.roughness;
          } else {
            throw std::logic_error("no roughness");
          }
        },
        s.scene.materials[static_cast<size_t>(material)].kind);
    r = {{u, -1}, {v, -1}, false};
    return material;
  };
  add("brushed_metal", brushed(s.conductor(0.9f, 0.2f), 0.4f, 0.1f), 0.1f);
  add("brushed_metal_stiff", brushed(s.conductor(0.9f, 0.2f), 0.05f, 0.8f), 0.05f);
  add("brushed_glass", brushed(s.dielectric(1.5f, 0.2f), 0.15f, 0.5f), 0.15f);
  const auto gltf = [&](MaterialKind kind) {
    s.scene.materials.push_back({"", std::move(kind), {}});
    return 0;
  };
  const auto metallic = [&](const Rgb& base, float metal, float roughness, float coat = 0) {
    MetallicRoughnessMaterial m;
    m.base_color.value = base;
    m.metallic.value = metal;
    m.roughness.value = roughness;
    m.clearcoat.value = coat;
    m.clearcoat_roughness.value = 0.3f;
    return gltf(m);
  };
  for (const float r : {0.25f, 0.5f, 0.8f, 1.0f}) {
    add("gltf_white_metal_" + std::to_string(r), metallic(white, 1, r), r * r);
    add("gltf_white_" + std::to_string(r), metallic(white, 0, r), r * r);
  }
  add("gltf_gold", metallic(gold, 1, 0.4f), 0.16f);
  add("gltf_half_metal", metallic(colour, 0.5f, 0.6f), 0.36f);
  add("gltf_coated", metallic(colour, 0.3f, 0.7f, 0.6f), 0.09f);
  add("gltf_coated_white", metallic(white, 0, 1, 1), 0.09f);
  add("gltf_coated_metal", metallic(white, 1, 0.5f, 1), 0.09f);
  const auto velvet = [&](const Rgb& base, const Rgb& sheen, float roughness, float metal = 0,
                          float coat = 0) {
    MetallicRoughnessMaterial m;
    m.base_color.value = base;
    m.metallic.value = metal;
    m.roughness.value = 0.7f;
    m.sheen_color.value = sheen;
    m.sheen_roughness.value = roughness;
    m.clearcoat.value = coat;
    m.clearcoat_roughness.value = 0.4f;
    return gltf(m);
  };
  for (const float r : {0.0f, 0.3f, 0.6f, 1.0f}) {
    add("gltf_velvet_" + std::to_string(r), velvet(white, white, r), 0.49f);
    add("gltf_fibres_" + std::to_string(r), velvet({0, 0, 0}, white, r), 0.49f);
  }
  add("gltf_velvet_red", velvet({0.4f, 0.1f, 0.1f}, {0.9f, 0.2f, 0.3f}, 0.4f), 0.49f);
  add("gltf_velvet_metal", velvet(gold, {0.3f, 0.3f, 0.6f}, 0.5f, 1), 0.49f);
  add("gltf_velvet_coated", velvet(colour, white, 0.5f, 0, 0.8f), 0.16f);
  const auto film = [&](const Rgb& base, float metal, float roughness, float nm, float ior = 1.3f,
                        float weight = 1, float coat = 0, const Rgb& sheen = {}) {
    MetallicRoughnessMaterial m;
    m.base_color.value = base;
    m.metallic.value = metal;
    m.roughness.value = roughness;
    m.clearcoat.value = coat;
    m.clearcoat_roughness.value = 0.3f;
    m.sheen_color.value = sheen;
    m.sheen_roughness.value = 0.5f;
    m.iridescence.value = weight;
    m.iridescence_ior = ior;
    m.iridescence_nm = {0, nm};
    return gltf(m);
  };
  add("film_white", film(white, 0, 0.5f, 400), 0.25f);
  add("film_white_dense", film(white, 0, 0.3f, 250, 2), 0.09f);
  add("film_white_rough", film(white, 0, 1, 550, 1.8f), 1);
  add("film_white_thin", film(white, 0, 0.5f, 0, 1.33f, 0.7f), 0.25f);
  add("film_metal", film(white, 1, 0.5f, 300), 0.25f);
  add("film_gold", film(gold, 1, 0.8f, 600, 2.2f), 0.64f);
  add("film_half_metal", film(white, 0.5f, 0.6f, 450, 1.6f, 0.6f), 0.36f);
  add("film_coated", film(colour, 0.3f, 0.7f, 350, 1.5f, 1, 0.6f), 0.09f);
  add("film_velvet", film(white, 0, 0.7f, 350, 1.5f, 1, 0, {0.6f, 0.6f, 0.9f}), 0.49f);
  const auto scratched = [&](const Rgb& base, float metal, float roughness, float strength, float coat = 0) {
    MetallicRoughnessMaterial m;
    m.base_color.value = base;
    m.metallic.value = metal;
    m.roughness.value = roughness;
    m.clearcoat.value = coat;
    m.clearcoat_roughness.value = 0.4f;
    m.anisotropy = strength;
    return gltf(m);
  };
  add("scratched_gold", scratched(gold, 1, 0.3f, 0.7f), 0.09f);
  add("scratched_white", scratched(white, 1, 0.5f, 1), 0.25f);
  add("scratched_dielectric", scratched(white, 0, 0.4f, 0.5f), 0.16f);
  add("scratched_coated", scratched(colour, 0.3f, 0.6f, 0.8f, 0.7f), 0.16f);
  const auto leaf = [&](const Rgb& base, const Rgb& through, float share, float roughness, float metal = 0,
                        float coat = 0) {
    MetallicRoughnessMaterial m;
    m.base_color.value = base;
    m.metallic.value = metal;
    m.roughness.value = roughness;
    m.clearcoat.value = coat;
    m.clearcoat_roughness.value = 0.4f;
    m.translucence.value = share;
    m.translucent_color.value = through;
    return gltf(m);
  };
  add("leaf_white", leaf(white, white, 0.6f, 0.5f), 0.25f);
  add("leaf_green", leaf(colour, {0.3f, 0.8f, 0.2f}, 0.4f, 0.7f), 0.49f);
  add("leaf_coated", leaf(colour, white, 1, 0.6f, 0.3f, 0.7f), 0.16f);
  const auto clear = [&](bool thin, float roughness, const Rgb& tint) {
    return gltf(TransmissionMaterial{{tint, -1}, {roughness, -1}, 1.5f, thin});
  };
  add("gltf_glass", clear(false, 0, white), 0);
  add("gltf_glass_green", clear(false, 0, {0.5f, 0.9f, 0.6f}), 0);
  add("gltf_glass_rough", clear(false, 0.6f, {0.5f, 0.9f, 0.6f}), 0.36f);
  add("gltf_sheet", clear(true, 0, white), 0);
  for (const float r : {0.4f, 0.7f, 1.0f})
    add("gltf_sheet_" + std::to_string(r), clear(true, r, white), r * r);
  add("gltf_sheet_tinted", clear(true, 0.5f, {0.5f, 0.9f, 0.6f}), 0.25f);
  const auto hair = [&](const Rgb& sigma_a, float beta_m, float beta_n) {
    HairMaterial m;
    m.sigma_a.value = sigma_a;
    m.beta_m = beta_m;
    m.beta_n = beta_n;
    return gltf(m);
  };
  add("hair_brown", hair({0.5f, 0.9f, 1.8f}, 0.3f, 0.3f), 0.05f);
  add("hair_white", hair(black, 0.3f, 0.3f), 0.05f);
  add("hair_rough", hair({0.1f, 0.2f, 0.3f}, 0.9f, 0.8f), 0.05f);
  add("hair_sleek", hair({0.1f, 0.2f, 0.3f}, 0.15f, 0.2f), 0.02f);
  const auto milky = [&](int material, const CoatMediumDescription& medium, float thickness) {
    std::visit(
        [&](auto& m) {
          if constexpr (requires { m.medium; }) {
            m.medium = medium;
            m.thickness = thickness;
          }
        },
        s.scene.materials[static_cast<size_t>(material)].kind);
    return material;
  };
  const CoatMediumDescription milk{{0.9f, 0.7f, 0.4f}, 0.5f}, snow{white, -0.3f};
  add("milky_smooth", milky(s.coated(colour, 1.5f, 0), milk, 0.4f), 0);
  add("milky_rough", milky(s.coated(colour, 1.5f, 0.3f), milk, 0.4f), 0.3f);
  add("milky_white", milky(s.coated(white, 1.3f, 0), snow, 2), 0);
  add("milky_white_rough", milky(s.coated(white, 1.3f, 0.3f), snow, 2), 0.3f);
  add("milky_lacquer", milky(s.coated_conductor(gold, 1.5f, 0, 0.3f), milk, 0.4f), 0.3f);
  add("milky_lacquer_rough", milky(s.coated_conductor(gold, 1.5f, 0.2f, 0.3f), milk, 0.4f), 0.2f);
  add("milky_lacquer_white", milky(s.coated_conductor(white, 1.5f, 0, 0.3f), snow, 1), 0.3f);
  // Their densities have kinks and are not bounded where the facet lies flat.
  constexpr float kSteep = 0.1f;
  TabulatedBrdf table;
  table.f = ggx_brdf(0.4, 0.4);
  table.alpha = 0.4;
  table.zeniths = 6;
  table.facets = table.warped = 16;
  add("measured_metal", gltf(measured_material(table)), kSteep);
  table.f = ggx_brdf(0.5, 0.25);
  table.azimuths = 9;
  add("measured_brushed", gltf(measured_material(table)), kSteep);
  const auto brushed_layers = [&](int material, float coat_u, float coat_v, float metal_u, float metal_v) {
    const Roughness of_coat{{coat_u, -1}, {coat_v, -1}, false}, of_metal{{metal_u, -1}, {metal_v, -1}, false};
    MaterialKind& kind = s.scene.materials[static_cast<size_t>(material)].kind;
    if (auto* m = std::get_if<CoatedDiffuseMaterial>(&kind)) m->roughness = of_coat;
    if (auto* m = std::get_if<CoatedConductorMaterial>(&kind)) {
      m->coat_roughness = of_coat;
      m->conductor.roughness = of_metal;
    }
    return material;
  };
  add("brushed_coat", brushed_layers(s.coated(colour, 1.5f, 0), 0.4f, 0.1f, 0, 0), 0.1f);
  add("brushed_lacquer_metal", brushed_layers(s.coated_conductor(gold, 1.5f, 0, 0), 0, 0, 0.4f, 0.1f), 0.1f);
  add("brushed_lacquer_both", brushed_layers(s.coated_conductor(gold, 1.5f, 0, 0), 0.1f, 0.3f, 0.4f, 0.1f),
      0.1f);
  add("brushed_lacquer_milky",
      milky(brushed_layers(s.coated_conductor(gold, 1.5f, 0, 0), 0, 0, 0.4f, 0.1f), milk, 0.4f), 0.1f);
  const auto principled = [&](const auto& edit) {
    PrincipledMaterial m;
    m.base_color.value = colour;
    edit(m);
    return gltf(m);
  };
  add("blender_principled", principled([](PrincipledMaterial&) {}), 0.25f);
  add("blender_principled_metal", principled([](PrincipledMaterial& m) {
        m.metallic.value = 1;
        m.roughness.value = 0.4f;
      }),
      0.16f);
  add("blender_principled_velvet", principled([](PrincipledMaterial& m) {
        m.sheen.value = 1;
        m.specular.value = 0;
        m.roughness.value = 1;
      }),
      1);
  add("blender_principled_coated", principled([](PrincipledMaterial& m) {
        m.metallic.value = 0.3f;
        m.clearcoat.value = 1;
        m.clearcoat_roughness.value = 0.4f;
        m.sheen.value = 0.5f;
      }),
      0.16f);
  add("blender_principled_brushed", principled([](PrincipledMaterial& m) {
        m.metallic.value = 1;
        m.anisotropic.value = 0.8f;
      }),
      0.13f);
  const auto glass_part = [](float roughness, float tint) {
    return [=](PrincipledMaterial& m) {
      m.part = PrincipledMaterial::Part::kGlass;
      m.transmission.value = 1;
      m.roughness.value = roughness;
      m.transmission_roughness.value = 0.4f;
      m.specular_tint.value = tint;
    };
  };
  add("blender_principled_glass", principled(glass_part(0.5f, 0.5f)), 0.25f);
  const auto closure = [&](ClosureKind kind, float roughness, FacetShape facets = FacetShape::kGgx,
                           float anisotropy = 0) {
    ClosureMaterial m;
    m.closure = kind;
    m.color.value = colour;
    m.roughness.value = roughness;
    m.facets = facets;
    m.anisotropy.value = anisotropy;
    return gltf(m);
  };
  add("blender_diffuse", closure(ClosureKind::kDiffuse, 0.7f), 0);
  const FacetShape shapes[] = {FacetShape::kGgx, FacetShape::kBeckmann, FacetShape::kAshikhminShirley};
  for (const FacetShape shape : shapes) {
    const std::string number = std::to_string(static_cast<int>(shape));
    add("blender_glossy_" + number, closure(ClosureKind::kGlossy, 0.5f, shape), 0.25f);
    add("blender_brushed_" + number, closure(ClosureKind::kGlossy, 0.6f, shape, 0.5f), 0.18f);
  }
  add("blender_mirror", closure(ClosureKind::kGlossy, 0), 0);
  add("blender_glass", closure(ClosureKind::kGlass, 0), 0);
  add("blender_glass_rough", closure(ClosureKind::kGlass, 0.5f), 0.25f);
  add("blender_glass_beckmann", closure(ClosureKind::kGlass, 0.6f, FacetShape::kBeckmann), 0.36f);
  add("blender_refraction", closure(ClosureKind::kRefraction, 0.5f), 0.25f);
  add("blender_translucent", closure(ClosureKind::kTranslucent, 0), 0);
  add("blender_velvet", closure(ClosureKind::kVelvet, 0.7f), 0);
  add("blender_toon", closure(ClosureKind::kToon, 0.4f, FacetShape::kGgx, 0.3f), 0);
  s.scene.materials.push_back({"",
                               [] {
                                 ClosureMaterial m;
                                 m.closure = ClosureKind::kToon;
                                 m.roughness.value = 0.3f;
                                 m.anisotropy.value = 0.2f;
                                 m.glossy = true;
                                 return m;
                               }(),
                               {}});
  add("blender_toon_glossy", 0, 0);
  // For ever: the cases point into its tables.
  static const std::vector<float> tables = build_scene(s.scene).bsdf_tables;
  const RenderScene scene = build_scene(s.scene);
  for (size_t i = 0; i < cases.size(); ++i) {
    cases[i].kind = scene.material_kind[i];
    cases[i].params.tables = tables.data();
    for (size_t k = 0; k < kBsdfParams; ++k)
      cases[i].params.p[k] = scene.material_params[i * kBsdfParams + k];
    if (anisotropic<float>(cases[i].kind)) cases[i].params.p[9] = 0.1f;  // turns
    if (cases[i].kind == kHair) cases[i].params.p[8] = 0.4f;             // offset from the axis
  }
  return cases;
}

Vec3<float> direction_at(double degrees, double phi) {
  const double t = degrees * M_PI / 180;
  return {static_cast<float>(std::sin(t) * std::cos(phi)), static_cast<float>(std::sin(t) * std::sin(phi)),
          static_cast<float>(std::cos(t))};
}

std::vector<Vec3<float>> outgoing_directions() {
  std::vector<Vec3<float>> result;
  for (const double degrees : {0.0, 25.0, 60.0, 85.0}) {
    result.push_back(direction_at(degrees));
    result.push_back(direction_at(180 - degrees));
  }
  return result;
}

}  // namespace lightmill::test
