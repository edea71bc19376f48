#pragma once
// Panes: thin sheets of smooth dielectric and of nothing else. Light passes them straight. So what is behind
// can be connected to, as through the boundary of a medium: the sun lights a room through its window. A
// segment goes through panes as it does through boundaries (medium_walk.h), and a path has a vertex at a pane
// only if it is reflected there. Both directions pass by the same rule, on the geometric normal: the
// transmittance of segments is the same for paths and connections.
//
// The probability that a path is not reflected by the panes of an edge belongs to that edge, both ways, like
// that of not being stopped in media. It is part of P in mis.h.
#include "worker/render/bsdf/thin_dielectric.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Transmittance of panes for rays that meet them at `cosine` in [0, 1]; 1 for primitives that are not panes.
template <class F>
inline F pane_transmittance(const RenderScene& scene, IntOf<F> prim, MaskOf<F> active, F cosine) {
  const IntOf<F> at = select(active, prim, IntOf<F>{});
  const MaskOf<F> pane =
      mask_and(active, MaskOf<F>((gather(scene.primitive_flags.data(), at) & RenderScene::kPane) != 0));
  const IntOf<F> material = select(pane, gather(scene.primitive_material.data(), at), IntOf<F>{});
  const F eta = gather(scene.material_params.data(), material * kBsdfParams);
  return select(pane, 1.0f - thin_reflectance(cosine, eta), splat<F>(1.0f));
}

}  // namespace lightmill
