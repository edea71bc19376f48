// Graphs that materials read, evaluated at eight points at once.
#include <bit>

#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/materials/blender_builder.h"

namespace lightmill {
namespace {

/// Calls visit(texture) for what the material reads; glTF's have no graphs.
template <class Visit>
void textures_read(const RenderScene& scene, const MaterialEntry& m, const Visit& visit) {
  if (m.blender >= 0) return visit_blender_textures(scene, m, visit);
  visit(m.texture_color);
  if (m.texture_u_roughness != m.texture_color) visit(m.texture_u_roughness);
  if (m.texture_v_roughness != m.texture_u_roughness) visit(m.texture_v_roughness);
  visit(m.texture_transmittance);
}

}  // namespace

void evaluate_graphs(const RenderScene& scene, const int32_t materials[8], unsigned mask, TexturePoint at[8],
                     KnownValues known[8]) {
  for (unsigned left = mask; left;) {
    // All lanes of the first one's material.
    const int32_t material = materials[std::countr_zero(left)];
    unsigned same = 0;
    for (int l = 0; l < 8; ++l)
      same |= static_cast<unsigned>((left >> l & 1) && materials[l] == material) << l;
    left &= ~same;
    const MaterialEntry& m = scene.materials[static_cast<size_t>(material)];
    if (std::popcount(same) < 2 || m.gltf >= 0) continue;
    TexturePoint points[8];
    for (int l = 0; l < 8; ++l) points[l] = at[same >> l & 1 ? l : std::countr_zero(same)];
    for (int l = 0; l < 8; ++l) known[l].count = same >> l & 1 ? 0 : known[l].count;
    textures_read(scene, m, [&](int texture) {
      if (!scene.textures.is_graph(texture)) return;
      Rgb values[8];
      scene.textures.evaluate_graph(texture, points, values);
      for (unsigned of = same; of; of &= of - 1) {
        const int l = std::countr_zero(of);
        KnownValues& k = known[l];
        if (k.count == KnownValues::kMost) return;
        k.texture[k.count] = texture;
        k.value[k.count++] = values[l];
        at[l].known = &k;
      }
    });
  }
}

}  // namespace lightmill
