#pragma once
// Fibres: tubes that are shaded as ribbons which face the viewer, as pbrt's flat curves do.
//
// A ribbon along the tube's axis that turns to every ray is as wide as the tube from everywhere, so the tube
// stands in for it. The tube is where rays meet the fibre, and its smooth normal tells how far from the axis.
// The vertex gets the ribbon's normal and lies just inside of the tube, whose back rays pass through (the
// acceleration structure leaves out hits from inside). So a fibre does not shade itself. What a ray meets
// depends on where it comes from: camera and light paths would not mean the same vertex by the same point. So
// renders with fibres have camera paths alone (renderer.cc).
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/math/angle.h"
#include "worker/render/scene/geometry/surface.h"

namespace lightmill {

/// Turns the fibres among `prim` to the viewer at unit direction `wo`: their vertex, both normals and, for
/// hair, the offset from the axis and the rotation of the fibre.
template <class F>
inline void face_fibres(const RenderScene& scene, const Surface<F>& surface, IntOf<F> prim, const Vec3<F>& wo,
                        IntOf<F> kind, Vec3<F>* p, Vec3<F>* ng, Vec3<F>* ns, BsdfParams<F>* params) {
  const IntOf<F> flags = gather(scene.primitive_flags.data(), prim);
  const MaskOf<F> fibre = MaskOf<F>((flags & RenderScene::kFibre) != 0);
  const MaskOf<F> hair = MaskOf<F>(kind == kHair);
  if (!any(mask_or(fibre, hair))) return;
  const Vec3<F> tangent = unit_tangent(surface.dpdu, surface.ns);
  const Vec3<F> across = wo - tangent * dot(wo, tangent);
  const F across2 = dot(across, across);
  const MaskOf<F> turned = mask_and(fibre, MaskOf<F>(across2 > 1e-10f));
  const Vec3<F> facing = across * (1.0f / sqrt(select(turned, across2, splat<F>(1.0f))));
  // To the outside, where the viewer is.
  const Vec3<F> out = surface.ng * copysign(splat<F>(1.0f), dot(surface.ng, wo));
  const Vec3<F> smooth = surface.ns * copysign(splat<F>(1.0f), dot(surface.ns, out));
  // Of a tube, the offset is the smooth normal's sine; of other surfaces of hair it is given by v, as in
  // pbrt.
  const Vec3<F> side = cross(facing, tangent);
  const F offset = select(turned, dot(smooth, side), 2.0f * surface.v - 1.0f);
  params->p[8] = select(hair, offset, params->p[8]);
  // By the bound of the position's error, and a bit further in than rays start further out.
  const F inwards = 4.0f * surface.error * (abs(surface.ng.x) + abs(surface.ng.y) + abs(surface.ng.z));
  *p = select(turned, *p - out * inwards, *p);
  *ng = select(turned, facing, *ng);
  *ns = select(turned, facing, select(hair, *ng, *ns));
}

}  // namespace lightmill
