#pragma once
// Mixes of materials: each point of the surface has one or the other, by chance.
//
// A path chooses by the first number of the direction that it goes on in, as between the lobes of a material
// (choose_lobe of bsdf.h): over the samples of a pixel each part gets its share, and directions that are
// stratified. Where there is no such number a hash of the point makes the choice, as in pbrt. A vertex keeps
// the choice with its kind and parameters. A mix's children may be mixes, which take what is left of the
// number; cycles have been refused before.
//
// By Blender's rules (MixRule) a choice stands for both parts: what the chosen one scatters is scaled by its
// weight over the probability of the choice, which follows what the parts scatter. The vertex's throughput
// takes that factor, whichever way the path goes. Transparent parts are never chosen: they are not met at all
// (common/scene/materials/see_through.h), and the others have their weights over the probability that a ray
// is stopped.
#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// A material, not a mix, and the factor of what it scatters.
struct MixChoice {
  int32_t material;
  float scale = 1;
  float u = 0;  // what is left of the number: a uniform again
};

/// The choice at point `p` (three floats) of primitive `prim`. `u`: a uniform in [0, 1); -1: a hash of the
/// point makes the choice, the same for the same point. `body`: where light that walks through the
/// body of this number would leave it, which by Blender's rules is everywhere; -1: nowhere.
MixChoice resolve_mix(const RenderScene& scene, int32_t material, int32_t prim, const float p[3],
                      const TexturePoint& at, float u = -1, int32_t body = -1);

/// Replaces the mixes among the active lanes' materials; `scale` is multiplied by their factors. `u`:
/// uniforms to choose by, which are stretched over the part that was chosen; null: hashes of the points.
template <class F>
inline IntOf<F> resolve_mixes(const RenderScene& scene, IntOf<F> material, MaskOf<F> active, IntOf<F> prim,
                              const Surface<F>& s, F* scale, F* u = nullptr,
                              const IntOf<F>* bodies = nullptr) {
  const MaskOf<F> mixed = mask_and(active, MaskOf<F>(gather(scene.material_kind.data(), material) == kMix));
  unsigned bits = mask_bits(mixed);
  if (bits == 0) return material;
  int32_t m[8];
  store(m, material);
  for (; bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const float p[3] = {lane(s.p.x, l), lane(s.p.y, l), lane(s.p.z, l)};
    const MixChoice choice = resolve_mix(scene, m[l], lane(prim, l), p, texture_point(scene, s, l),
                                         u ? lane(*u, l) : -1, bodies ? lane(*bodies, l) : -1);
    m[l] = choice.material;
    if (u) set_lane(u, l, choice.u);
    if (choice.scale != 1) set_lane(scale, l, lane(*scale, l) * choice.scale);
  }
  return load_int<F>(m);
}

}  // namespace lightmill
