#include "common/scene/gltf/materials.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "common/scene/gltf/light_groups.h"

namespace lightmill {
namespace {

constexpr std::array<std::string_view, 12> kMaterialExtensions = {"KHR_materials_emissive_strength",
                                                                  "KHR_materials_ior",
                                                                  "KHR_materials_specular",
                                                                  "KHR_materials_clearcoat",
                                                                  "KHR_materials_transmission",
                                                                  "KHR_materials_volume",
                                                                  "KHR_materials_pbrSpecularGlossiness",
                                                                  "KHR_materials_unlit",
                                                                  "KHR_materials_sheen",
                                                                  "KHR_materials_iridescence",
                                                                  "KHR_materials_anisotropy",
                                                                  "KHR_materials_diffuse_transmission"};
constexpr std::array<std::string_view, 12> kOtherExtensions = {
    "KHR_texture_transform",   "KHR_lights_punctual",
    "KHR_mesh_quantization",   "EXT_mesh_gpu_instancing",
    "KHR_materials_variants",  // of variants, the default
    "EXT_texture_webp",        "EXT_meshopt_compression",
    "KHR_meshopt_compression", "KHR_draco_mesh_compression",
    "KHR_node_visibility",     "KHR_animation_pointer",
    "KHR_xmp_json_ld"};  // of which nothing is shown

constexpr double kMaxEmission = 1e30;

bool among(std::string_view name, const auto& list) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

}  // namespace

bool knows_gltf_extension(const std::string& name) {
  return among(name, kMaterialExtensions) || among(name, kOtherExtensions);
}

const GltfSurface& GltfMaterials::surface(int index, bool vertex_colors) {
  const auto key = std::pair{index, vertex_colors};
  if (const auto found = surfaces_.find(key); found != surfaces_.end()) return found->second;
  GltfSurface result;
  const bool good = scene_.attempt([&] {
    const GltfValue material =
        index >= 0 ? root_.require("materials")[static_cast<size_t>(index)] : root_.nothing();
    result = translate(material, vertex_colors);
    std::string& name = scene_.scene.materials[static_cast<size_t>(result.material)].name;
    if (name.empty()) name = index >= 0 ? "material " + std::to_string(index) : "default";
  });
  if (!good) {  // reported: a place holder
    scene_.scene.materials.push_back({"", DiffuseMaterial{}, {scene_.name, 1, 1}});
    result.material = static_cast<int>(scene_.scene.materials.size()) - 1;
  }
  return surfaces_[key] = result;
}

void GltfMaterials::name_unsupported(const GltfValue& material) {
  const auto extensions = material.find_object("extensions");
  if (!extensions) return;
  for (const std::string& name : extensions->keys()) {
    if (name.starts_with("KHR_materials_") && !knows_gltf_extension(name)) {
      scene_.unsupported(extensions->require(name.c_str()).pointer(), name + " is ignored");
    }
  }
}

FloatInput GltfMaterials::alpha(const GltfValue& material, const GltfValue& base, const char* texture,
                                float factor, bool vertex_colors) {
  const std::string mode = material.text_or("alphaMode", "OPAQUE");
  if (mode != "MASK" && mode != "BLEND") {
    if (mode != "OPAQUE")
      material.require("alphaMode")
          .mended("is neither OPAQUE, MASK nor BLEND: " + in_quotes(mode) + "; OPAQUE is used");
    return {1, -1};
  }
  FloatInput a{factor, textures_.image(base, texture, ImageChannel::kAlpha, false, factor)};
  if (vertex_colors) {
    const int of_vertex = textures_.add(VertexColorTexture{true}, material, false);
    a.texture =
        a.texture >= 0
            ? textures_.product(a.texture, of_vertex)
            : textures_.add(ProductTexture{{{factor, factor, factor}, -1}, {{}, of_vertex}}, material, false);
  }
  if (mode == "BLEND") return a;
  const auto cutoff = static_cast<float>(material.number_or("alphaCutoff", 0.5, 0, 1e6));
  if (a.texture < 0) return {factor >= cutoff ? 1.0f : 0.0f, -1};
  return {1, textures_.add(StepTexture{a, cutoff}, material, false)};
}

MediumInterface GltfMaterials::volume(const GltfValue& volume) {
  const auto distance = volume.find("attenuationDistance");
  if (!distance) return {};  // glTF's default: infinitely far
  const double d = volume.number_or("attenuationDistance", 0, 0, 1e30);
  if (!(d > 0)) {
    distance->mended("is not above 0; nothing is absorbed");
    return {};
  }
  const Rgb color = volume.color_or("attenuationColor", {1, 1, 1}, 1);
  // What of a white beam is left after that distance; black lets next to nothing through.
  const auto absorption = [&](float x) {
    return static_cast<float>(-std::log(std::max(double{x}, 1e-12)) / d);
  };
  MediumDescription medium;
  medium.sigma_a = {absorption(color.r), absorption(color.g), absorption(color.b)};
  medium.sigma_s = {0, 0, 0};
  medium.location = scene_.likely_place(volume.pointer());
  if (!std::isfinite(medium.sigma_a.r + medium.sigma_a.g + medium.sigma_a.b)) {
    distance->mended("is smaller than float can hold the absorption of; nothing is absorbed");
    return {};
  }
  scene_.scene.media.push_back(std::move(medium));
  return {static_cast<int>(scene_.scene.media.size()) - 1, -1};
}

void GltfMaterials::transmit(const GltfValue& material, MaterialDescription* description,
                             GltfSurface* surface) {
  const auto extension = material.extension("KHR_materials_transmission");
  const auto* opaque = std::get_if<MetallicRoughnessMaterial>(&description->kind);
  if (!extension || opaque == nullptr) return;
  auto amount = static_cast<float>(extension->number_or("transmissionFactor", 0, 0, 1));
  amount *= opaque->metallic.texture < 0 ? 1 - opaque->metallic.value : 1;  // metals let nothing through
  if (!(amount > 0)) return;
  const FloatInput share = textures_.number(*extension, "transmissionTexture", ImageChannel::kRed, amount);
  if (opaque->iridescence.value > 0)
    scene_.unsupported(extension->pointer(), "the part that transmits has no iridescence");
  if (opaque->translucence.value > 0 && (share.texture >= 0 || share.value < 1))
    scene_.unsupported(extension->pointer(), "a material that transmits has no diffuse transmission");
  if (opaque->anisotropy > 0)
    scene_.unsupported(extension->pointer(), "the part that transmits has no anisotropy");
  TransmissionMaterial clear;
  clear.color = opaque->base_color;
  clear.roughness = opaque->roughness;
  clear.ior = opaque->ior == 0 ? 1000.0f : opaque->ior;
  const auto inside = material.extension("KHR_materials_volume");
  clear.thin = !inside || !(inside->number_or("thicknessFactor", 0, 0, 1e30) > 0);
  if (!clear.thin) surface->media = volume(*inside);
  if (share.texture < 0 && share.value >= 1) {
    description->kind = clear;
    return;
  }
  // A blend of lobes under one coat is the blend of what is coated with either.
  auto& materials = scene_.scene.materials;
  const auto first = static_cast<int>(materials.size());
  materials.push_back(*description);
  MaterialDescription second = *description;
  second.kind = clear;
  materials.push_back(std::move(second));
  description->kind = MixMaterial{{first, first + 1}, share};
}

void GltfMaterials::unlit(const GltfValue& material, const SpectrumInput& color,
                          MaterialDescription* description, GltfSurface* surface) {
  description->kind = DiffuseMaterial{{{0, 0, 0}, -1}};
  AreaLightDescription light;
  light.radiance = color.texture < 0 ? color.value : Rgb{1, 1, 1};
  light.texture = color.texture;
  light.two_sided = true;
  light.location = description->location;
  if (light.texture < 0 && !(light.radiance.r > 0 || light.radiance.g > 0 || light.radiance.b > 0)) return;
  light.light_group = gltf_light_group(material).value_or("");
  surface->area_light = static_cast<int>(scene_.scene.area_lights.size());
  scene_.scene.area_lights.push_back(light);
}

void GltfMaterials::emission(const GltfValue& material, GltfSurface* surface) {
  Rgb factor = material.color_or("emissiveFactor", {0, 0, 0}, kMaxEmission);
  if (!(factor.r > 0 || factor.g > 0 || factor.b > 0)) return;
  if (const auto strength = material.extension("KHR_materials_emissive_strength")) {
    const auto s = static_cast<float>(strength->number_or("emissiveStrength", 1, 0, kMaxEmission));
    factor = {factor.r * s, factor.g * s, factor.b * s};
    if (!std::isfinite(factor.r + factor.g + factor.b)) {
      strength->mended("the emission is brighter than float can hold; it is clamped");
      const auto finite = [](float x) { return std::min(x, static_cast<float>(kMaxEmission)); };
      factor = {finite(factor.r), finite(factor.g), finite(factor.b)};
    }
  }
  AreaLightDescription light;
  light.radiance = factor;
  light.two_sided = material.boolean_or("doubleSided", false);
  light.location = scene_.likely_place(material.pointer());
  light.texture = textures_.image(material, "emissiveTexture", ImageChannel::kRgb, true);
  light.light_group = gltf_light_group(material).value_or("");
  surface->area_light = static_cast<int>(scene_.scene.area_lights.size());
  scene_.scene.area_lights.push_back(light);
}

GltfSurface GltfMaterials::translate(const GltfValue& material, bool vertex_colors) {
  textures_.begin_material(material);
  name_unsupported(material);
  MaterialDescription d;
  d.name = material.text_or("name", "");
  d.location = scene_.likely_place(material.pointer());
  const auto gloss = material.extension("KHR_materials_pbrSpecularGlossiness");
  const auto metal_rough = material.find_object("pbrMetallicRoughness");
  const GltfValue base = gloss ? *gloss : metal_rough ? *metal_rough : material.nothing();
  const char* factor_key = gloss ? "diffuseFactor" : "baseColorFactor";
  const char* texture_key = gloss ? "diffuseTexture" : "baseColorTexture";
  const auto factor = base.numbers_or(factor_key, {1, 1, 1, 1}, 0, 1);
  const auto f = [&](size_t i) { return static_cast<float>(factor[i]); };
  SpectrumInput color = textures_.color(base, texture_key, {f(0), f(1), f(2)});
  if (vertex_colors) {
    const int of_vertex = textures_.add(VertexColorTexture{}, material, true);
    color.texture = color.texture >= 0
                        ? textures_.product(color.texture, of_vertex)
                        : textures_.add(ProductTexture{{color.value, -1}, {{}, of_vertex}}, material, true);
  }
  GltfSurface surface;
  surface.alpha = alpha(material, base, texture_key, f(3), vertex_colors);
  surface.invisible = surface.alpha.texture < 0 && !(surface.alpha.value > 0);
  if (material.extension("KHR_materials_unlit")) {
    // Seen in its colour whatever the light: it shines with it and reflects nothing.
    unlit(material, color, &d, &surface);
  } else {
    d.kind = bsdf(material, color, base);
    transmit(material, &d, &surface);
    const auto* m = std::get_if<MetallicRoughnessMaterial>(&d.kind);
    const auto inside = material.extension("KHR_materials_volume");
    if (m && m->translucence.value > 0 && inside && inside->number_or("thicknessFactor", 0, 0, 1e30) > 0)
      surface.media = volume(*inside);
    emission(material, &surface);
  }
  if (const auto normal = material.find_object("normalTexture")) {
    d.normal_map = textures_.image(material, "normalTexture", ImageChannel::kRgb, false);
    d.normal_scale = static_cast<float>(normal->number_or("scale", 1, -1e6, 1e6));
    d.normal_follows_v = true;
  }
  surface.uv_set = textures_.uv_set();
  surface.second_uv_set = textures_.second_uv_set();
  surface.textured = textures_.used();
  // A mix takes the normal map of what it mixes.
  for (int child : {0, 1}) {
    const auto* mix = std::get_if<MixMaterial>(&d.kind);
    if (mix == nullptr) break;
    MaterialDescription& m =
        scene_.scene.materials[static_cast<size_t>(mix->materials[static_cast<size_t>(child)])];
    m.normal_map = d.normal_map;
    m.normal_scale = d.normal_scale;
    m.normal_follows_v = d.normal_follows_v;
  }
  surface.material = static_cast<int>(scene_.scene.materials.size());
  scene_.scene.materials.push_back(std::move(d));
  return surface;
}

}  // namespace lightmill
