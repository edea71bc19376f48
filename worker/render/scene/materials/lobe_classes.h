#pragma once
// Materials with diffuse and glossy lobes, in scenes where diffuse and glossy rays see different things.
//
// A vertex of a Principled BSDF then has one class of its lobes, chosen by chance, as a vertex of a mix has
// one of its parts. What rays and connections of the vertex see is decided by that class, so that both are
// right on the average (as in Cycles, which leaves lobes out of what it evaluates). It costs noise; other
// scenes keep their lobes together. Other materials with both have diffuse rays alone.
#include "worker/render/bsdf/blender/principled.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

inline bool separates_lobes(const RenderScene& scene) {
  return (scene.hides & (kDiffuseRays | kGlossyRays)) != 0;
}

template <class F>
inline MaskOf<F> has_both_classes(IntOf<F> kind) {
  return mask_or(MaskOf<F>(kind == kPrincipled), MaskOf<F>(kind == kAnisotropicPrincipled));
}

/// Whether a Principled BSDF has lost its diffuse lobes, or had none.
inline bool is_glossy_alone(float red, float green, float blue) {
  return red == 0 && green == 0 && blue == 0;
}

/// Takes one class of lobes from the parameters of the lanes of such kinds, seen at `cosine`. Chooses by `u`,
/// which is a uniform again afterwards. Returns the factor of what is left.
template <class F>
inline F choose_lobe_class(IntOf<F> kind, MaskOf<F> active, F cosine, BsdfParams<F>* params, F* u) {
  const MaskOf<F> both = mask_and(active, has_both_classes<F>(kind));
  if (!any(both)) return splat<F>(1.0f);
  const F z = min(abs(cosine), splat<F>(1.0f));
  const Principled<F, false> lobes(*params, both);
  const F p = select(both, lobes.side({safe_sqrt(1.0f - z * z), F{}, z}).diffuse, splat<F>(1.0f));
  F left = *u;
  const MaskOf<F> diffuse = choose_lobe(p, &left);
  *u = select(both, left, *u);
  const MaskOf<F> no_glossy = mask_and(both, diffuse), no_diffuse = mask_and(both, mask_not(diffuse));
  const auto clear = [](MaskOf<F> where, F packed, int bits) {
    return select(where, to_float(to_int(select(where, packed, F{})) & ~bits), packed);
  };
  constexpr int kThird = 0xff, kSecond = 0xff00, kFirst = 0xff0000;
  F* q = params->p;
  for (size_t i = 0; i < 3; ++i) q[i] = select(no_diffuse, F{}, q[i]);
  // A fibre's diffuse light over a black base is no glossy light.
  q[0] = select(mask_and(no_glossy, MaskOf<F>(max(max(q[0], q[1]), q[2]) == 0.0f)), splat<F>(1e-30f), q[0]);
  for (size_t i = 3; i < 6; ++i) q[i] = select(no_glossy, F{}, q[i]);
  q[7] = clear(no_glossy, q[7], kThird);   // weight of the specular lobe
  q[8] = clear(no_glossy, q[8], kSecond);  // coat
  q[8] = clear(no_diffuse, q[8], kFirst);  // sheen
  return select(both, 1.0f / select(diffuse, p, max(1.0f - p, splat<F>(1e-12f))), splat<F>(1.0f));
}

}  // namespace lightmill
