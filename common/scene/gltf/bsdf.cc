// What a glTF material reflects: metallic-roughness and the extensions that add to it.
#include <cmath>

#include "common/scene/gltf/materials.h"

namespace lightmill {

MaterialKind GltfMaterials::bsdf(const GltfValue& material, const SpectrumInput& base,
                                 const GltfValue& metal_rough) {
  MetallicRoughnessMaterial m;
  m.base_color = base;
  if (const auto gloss = material.extension("KHR_materials_pbrSpecularGlossiness")) {
    // A dielectric of any F0, which ior = 0 stands for (KHR_materials_ior).
    const auto glossiness = static_cast<float>(gloss->number_or("glossinessFactor", 1, 0, 1));
    const char* texture = "specularGlossinessTexture";
    m.ior = 0;
    m.metallic = {0, -1};
    m.specular_color = textures_.color(*gloss, texture, gloss->color_or("specularFactor", {1, 1, 1}, 1));
    m.roughness = {1 - glossiness,
                   textures_.image(*gloss, texture, ImageChannel::kAlpha, false, glossiness, true)};
    return m;
  }
  const auto factor = [&](const char* key) {
    return static_cast<float>(metal_rough.number_or(key, 1, 0, 1));
  };
  const char* texture = "metallicRoughnessTexture";
  m.metallic = {factor("metallicFactor"), -1};
  if (m.metallic.value > 0)
    m.metallic = textures_.number(metal_rough, texture, ImageChannel::kBlue, m.metallic.value);
  m.roughness = {factor("roughnessFactor"), -1};
  if (m.roughness.value > 0)
    m.roughness = textures_.number(metal_rough, texture, ImageChannel::kGreen, m.roughness.value);
  if (const auto ior = material.extension("KHR_materials_ior")) {
    m.ior = static_cast<float>(ior->number_or("ior", 1.5, 0, 1000));
    if (m.ior != 0 && m.ior < 1) {
      ior->require("ior").mended("must be 0 or at least 1; it is clamped to 1");
      m.ior = 1;
    }
  }
  if (const auto specular = material.extension("KHR_materials_specular")) {
    m.specular = textures_.number(*specular, "specularTexture", ImageChannel::kAlpha,
                                  static_cast<float>(specular->number_or("specularFactor", 1, 0, 1)));
    m.specular_color = textures_.color(*specular, "specularColorTexture",
                                       specular->color_or("specularColorFactor", {1, 1, 1}, 1e6));
  }
  if (const auto sheen = material.extension("KHR_materials_sheen")) {
    const Rgb color = sheen->color_or("sheenColorFactor", {0, 0, 0}, 1);
    if (color.r > 0 || color.g > 0 || color.b > 0) {
      m.sheen_color = textures_.color(*sheen, "sheenColorTexture", color);
      m.sheen_roughness =
          textures_.number(*sheen, "sheenRoughnessTexture", ImageChannel::kAlpha,
                           static_cast<float>(sheen->number_or("sheenRoughnessFactor", 0, 0, 1)));
    }
  }
  if (const auto brushed = material.extension("KHR_materials_anisotropy")) {
    m.anisotropy = static_cast<float>(brushed->number_or("anisotropyStrength", 0, 0, 1));
    const double turns = brushed->number_or("anisotropyRotation", 0, -1e6, 1e6) / (2 * M_PI);
    m.anisotropy_rotation = static_cast<float>(turns - std::floor(turns));
    if (m.anisotropy > 0)
      m.anisotropy_texture = textures_.image(*brushed, "anisotropyTexture", ImageChannel::kRgb, false);
  }
  if (const auto film = material.extension("KHR_materials_iridescence")) {
    m.iridescence = {static_cast<float>(film->number_or("iridescenceFactor", 0, 0, 1)), -1};
    if (m.iridescence.value > 0) {
      m.iridescence = textures_.number(*film, "iridescenceTexture", ImageChannel::kRed, m.iridescence.value);
      m.iridescence_ior = static_cast<float>(film->number_or("iridescenceIor", 1.3, 1, 1000));
      m.iridescence_nm = {static_cast<float>(film->number_or("iridescenceThicknessMinimum", 100, 0, 1e5)),
                          static_cast<float>(film->number_or("iridescenceThicknessMaximum", 400, 0, 1e5))};
      m.iridescence_thickness =
          textures_.number(*film, "iridescenceThicknessTexture", ImageChannel::kGreen, 1);
    }
  }
  if (const auto coat = material.extension("KHR_materials_clearcoat")) {
    const auto amount = static_cast<float>(coat->number_or("clearcoatFactor", 0, 0, 1));
    if (amount > 0) {
      m.clearcoat = textures_.number(*coat, "clearcoatTexture", ImageChannel::kRed, amount);
      m.clearcoat_roughness =
          textures_.number(*coat, "clearcoatRoughnessTexture", ImageChannel::kGreen,
                           static_cast<float>(coat->number_or("clearcoatRoughnessFactor", 0, 0, 1)));
      if (coat->find("clearcoatNormalTexture"))
        scene_.unsupported(coat->pointer(), "a normal map of the clear coat alone is ignored");
    }
  }
  if (const auto through = material.extension("KHR_materials_diffuse_transmission")) {
    const auto share = static_cast<float>(through->number_or("diffuseTransmissionFactor", 0, 0, 1));
    if (share > 0) {
      m.translucence = textures_.number(*through, "diffuseTransmissionTexture", ImageChannel::kAlpha, share);
      m.translucent_color =
          textures_.color(*through, "diffuseTransmissionColorTexture",
                          through->color_or("diffuseTransmissionColorFactor", {1, 1, 1}, 1));
    }
  }
  if (m.translucence.value > 0 &&
      (m.iridescence.value > 0 || m.anisotropy > 0 || m.sheen_color.value != Rgb{0, 0, 0})) {
    scene_.unsupported(material.pointer(),
                       "a material with sheen, iridescence or anisotropy transmits nothing "
                       "diffusely");
    m.translucence = {0, -1};
  }
  if (m.anisotropy > 0 && (m.iridescence.value > 0 || m.sheen_color.value != Rgb{0, 0, 0})) {
    scene_.unsupported(material.pointer(), "a material with sheen or iridescence has no anisotropy");
    m.anisotropy = 0;
  }
  return m;
}

}  // namespace lightmill
