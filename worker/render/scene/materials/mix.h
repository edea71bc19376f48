#pragma once
// Mixes of materials: each point of the surface has one or the other, by chance.
//
// As in pbrt a hash of the point makes the choice. So it needs no random numbers and is the same in every
// lane width and on every machine. A vertex keeps the choice with its kind and parameters. A mix's children
// may be mixes; cycles have been refused before.
#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// The material, not a mix, at point `p` (three floats) of primitive `prim`.
int32_t resolve_mix(const RenderScene& scene, int32_t material, int32_t prim, const float p[3],
                    const TexturePoint& at);

/// Replaces the mixes among the active lanes' materials.
template <class F>
inline IntOf<F> resolve_mixes(const RenderScene& scene, IntOf<F> material, MaskOf<F> active, IntOf<F> prim,
                              const Surface<F>& s) {
  const MaskOf<F> mixed = mask_and(active, MaskOf<F>(gather(scene.material_kind.data(), material) == kMix));
  unsigned bits = mask_bits(mixed);
  if (bits == 0) return material;
  int32_t m[8];
  store(m, material);
  for (; bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const float p[3] = {lane(s.p.x, l), lane(s.p.y, l), lane(s.p.z, l)};
    m[l] = resolve_mix(scene, m[l], lane(prim, l), p, texture_point(scene, s, l));
  }
  return load_int<F>(m);
}

}  // namespace lightmill
