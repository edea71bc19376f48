#include "worker/render/scene/mix.h"

#include <bit>

namespace lightmill {
namespace {

/// Finaliser of MurmurHash3 (Appleby, public domain): every bit of x changes half of the result's.
uint32_t scramble(uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

}  // namespace

int32_t resolve_mix(const RenderScene& scene, int32_t material, int32_t prim, const float p[3],
                    const TexturePoint& at) {
  uint32_t h = scramble(static_cast<uint32_t>(prim) + 0x9e3779b9u);
  for (int i = 0; i < 3; ++i) h = scramble(h + std::bit_cast<uint32_t>(p[i] + 0.0f));  // -0 is 0
  for (;;) {
    const MaterialEntry& e = scene.materials[static_cast<size_t>(material)];
    if (e.kind != kMix) return material;
    const float amount = e.texture_color >= 0 ? scene.textures.evaluate(e.texture_color, at).r : e.scale;
    h = scramble(h + static_cast<uint32_t>(material));
    const float chance = static_cast<float>(h >> 8) * 0x1p-24f;  // in [0, 1)
    material = chance < amount ? e.mix_second : e.mix_first;
  }
}

}  // namespace lightmill
