#pragma once
// Parameters of glTF's materials, constant or at a textured point (bsdf/metallic_roughness.h, layered/tinted.h).
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Whether some of its light comes from fibres.
bool has_sheen(const MetallicRoughnessMaterial& material);
bool has_translucence(const MetallicRoughnessMaterial& material);
bool has_film(const MetallicRoughnessMaterial& material);

/// Kinds and first parameters; the materials stay in scene.metallic and scene.tinted, where textured points
/// find them by entry.gltf. Needs the metallic table at the beginning of the scene's tables,
/// and for sheen its own behind it.
void build_metallic_roughness(const MetallicRoughnessMaterial& material, RenderScene* scene,
                              MaterialEntry* entry, float* params);
void build_transmission(const TransmissionMaterial& material, RenderScene* scene, MaterialEntry* entry,
                        float* params);

/// Overwrites the parameters of a textured material of one of these kinds.
void apply_gltf_textures(const RenderScene& scene, const MaterialEntry& entry, const TexturePoint& at,
                         float* params);

}  // namespace lightmill
