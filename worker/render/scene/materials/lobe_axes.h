#pragma once
// The direction of anisotropic lobes at a surface point.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/math/angle.h"
#include "worker/render/scene/geometry/surface.h"

namespace lightmill {

/// Sets the rotation of anisotropic lanes, in turns: from the first axis of Frame(ns) to dp/du; for glTF's,
/// to the direction that they give by an angle from dp/du towards dp/dv.
template <class F>
inline void orient_lobes(const Surface<F>& surface, const Vec3<F>& ns, IntOf<F> kind, BsdfParams<F>* params) {
  const MaskOf<F> lies = anisotropic<F>(kind);
  if (!any(lies)) return;
  const Frame<F> frame(ns);
  const Vec3<F> tangent = frame.to_local(unit_tangent(surface.dpdu, ns));
  F rotation = turns(tangent.y, tangent.x);
  const MaskOf<F> gltf = MaskOf<F>(kind == kAnisotropicMetallicRoughness);
  const MaskOf<F> blender =
      mask_or(MaskOf<F>(kind == kAnisotropicPrincipled), MaskOf<F>(kind == kAnisotropicGlossy));
  if (any(blender)) {
    const F turned = rotation + select(blender, params->p[9], F{});
    rotation = turned - floor(turned);
  }
  if (any(gltf)) {
    const F of_material = copysign(params->p[9], dot(cross(ns, surface.dpdu), surface.dpdv));
    const F turned = rotation + select(gltf, of_material, F{});
    rotation = turned - floor(turned);
  }
  params->p[9] = select(lies, rotation, params->p[9]);
}

}  // namespace lightmill
