#pragma once
// Parameters of glTF's materials, constant or at a textured point (bsdf/metallic_roughness.h,
// layered/tinted.h).
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Whether the material has sheen, translucence or a thin film.
bool has_sheen(const MetallicRoughnessMaterial& material);
bool has_translucence(const MetallicRoughnessMaterial& material);
bool has_film(const MetallicRoughnessMaterial& material);

/// Sets kinds and first parameters. The materials stay in scene.metallic and scene.tinted, where textured
/// points find them by entry.gltf. The scene's tables must begin with the metallic table, followed by that of
/// sheen if it is used.
void build_metallic_roughness(const MetallicRoughnessMaterial& material, RenderScene* scene,
                              MaterialEntry* entry, float* params);
void build_transmission(const TransmissionMaterial& material, RenderScene* scene, MaterialEntry* entry,
                        float* params);

/// Overwrites the parameters of a textured material of one of these kinds.
void apply_gltf_textures(const RenderScene& scene, const MaterialEntry& entry, const TexturePoint& at,
                         float* params);

}  // namespace lightmill
