#pragma once
// Panes: thin sheets of smooth dielectric and of nothing else. Light passes them straight. So what is behind
// can be connected to, as through the boundary of a medium: the sun lights a room through its window. A
// segment goes through panes as it does through boundaries (medium_walk.h), and a path has a vertex at a pane
// only if it is reflected there. Both directions pass by the same rule, on the geometric normal: the
// transmittance of segments is the same for paths and connections.
//
// The probability that a path is not reflected by the panes of an edge belongs to that edge, both ways, like
// that of not being stopped in media. It is part of P in mis.h.
//
// Surfaces of Transparent BSDFs with a colour (common/scene/materials/see_through.h) are panes, too: those of
// a mix stop a path for another part with the probability of their opacity, and what passes is absorbed by
// channel.
#include <algorithm>
#include <bit>

#include "worker/render/bsdf/thin_dielectric.h"
#include "worker/render/math/exp.h"
#include "worker/render/scene/geometry/surface.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// Transmittance of panes for rays that meet them at `s`, at `cosine` in [0, 1]; 1 for primitives that are
/// not panes. `depth` grows by what panes of Transparent BSDFs with a colour absorb.
template <class F>
inline F pane_transmittance(const RenderScene& scene, IntOf<F> prim, MaskOf<F> active, F cosine,
                            const Surface<F>& s, Vec3<F>* depth) {
  const IntOf<F> at = select(active, prim, IntOf<F>{});
  const MaskOf<F> pane =
      mask_and(active, MaskOf<F>((gather(scene.primitive_flags.data(), at) & RenderScene::kPane) != 0));
  const IntOf<F> material = select(pane, gather(scene.primitive_material.data(), at), IntOf<F>{});
  const MaskOf<F> glass =
      mask_and(pane, MaskOf<F>(gather(scene.material_kind.data(), material) == kThinDielectric));
  const F eta = gather(scene.material_params.data(), material * kBsdfParams);
  F passed =
      select(glass, 1.0f - thin_reflectance(cosine, select(glass, eta, splat<F>(1.5f))), splat<F>(1.0f));
  for (unsigned bits = mask_bits(mask_and(pane, mask_not(glass))); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const MaterialEntry& m = scene.materials[static_cast<size_t>(lane(material, l))];
    const float stops = m.opacity.texture < 0
                            ? m.opacity.value
                            : scene.textures.evaluate(m.opacity.texture, texture_point(scene, s, l)).r;
    constexpr float kLeastTint = 1e-30f;
    const auto absorbed = [&](float tint) { return -log_positive(std::max(tint, kLeastTint)); };
    set_lane(&passed, l, 1 - std::clamp(stops, 0.0f, 1.0f));
    set_lane(&depth->x, l, lane(depth->x, l) + absorbed(m.tint.r));
    set_lane(&depth->y, l, lane(depth->y, l) + absorbed(m.tint.g));
    set_lane(&depth->z, l, lane(depth->z, l) + absorbed(m.tint.b));
  }
  return passed;
}

}  // namespace lightmill
