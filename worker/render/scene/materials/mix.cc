#include "worker/render/scene/materials/mix.h"

#include "worker/render/sampling/sobol.h"

namespace lightmill {

int32_t resolve_mix(const RenderScene& scene, int32_t material, int32_t prim, const float p[3],
                    const TexturePoint& at) {
  uint32_t h = hash32(static_cast<uint32_t>(prim));
  for (int i = 0; i < 3; ++i) h = hash_combine(h, float_bits(p[i] + 0.0f));  // -0 is 0
  for (;;) {
    const MaterialEntry& e = scene.materials[static_cast<size_t>(material)];
    if (e.kind != kMix) return material;
    const float amount = e.texture_color >= 0 ? scene.textures.evaluate(e.texture_color, at).r : e.scale;
    h = hash_combine(h, static_cast<uint32_t>(material));
    const float chance = static_cast<float>(h >> 8) * 0x1p-24f;  // in [0, 1)
    material = chance < amount ? e.mix_second : e.mix_first;
  }
}

}  // namespace lightmill
