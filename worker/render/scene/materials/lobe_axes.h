#pragma once
// The direction of anisotropic lobes at a surface point.
#include "worker/render/bsdf/bsdf.h"
#include "worker/render/math/angle.h"
#include "worker/render/scene/geometry/surface.h"

namespace lightmill {

/// What the lobes lie along: dp/du, or the tangent of the lane's material. Of any length.
template <class F>
inline Vec3<F> lobe_tangents(const RenderScene& scene, IntOf<F> material, MaskOf<F> lies,
                             const Surface<F>& surface) {
  float t[3][8];
  store(t[0], surface.dpdu.x), store(t[1], surface.dpdu.y), store(t[2], surface.dpdu.z);
  for (unsigned bits = mask_bits(lies); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const int texture = scene.materials[static_cast<size_t>(lane(material, l))].tangent;
    if (texture < 0) continue;
    const Rgb given = scene.textures.evaluate(texture, texture_point(scene, surface, l));
    const Vec3<float> along = scene.textures.normal_of_graph(texture, given);
    const float length2 = dot(along, along);
    if (length2 > 0x1p-100f && length2 < 0x1p100f) t[0][l] = along.x, t[1][l] = along.y, t[2][l] = along.z;
  }
  return {load<F>(t[0]), load<F>(t[1]), load<F>(t[2])};
}

/// Sets the rotation of anisotropic lanes, in turns: from the first axis of Frame(ns) to dp/du, or to the
/// tangent of the material; for glTF's, to the direction that they give by an angle from dp/du towards dp/dv.
template <class F>
inline void orient_lobes(const RenderScene& scene, IntOf<F> material, MaskOf<F> active,
                         const Surface<F>& surface, const Vec3<F>& ns, IntOf<F> kind, BsdfParams<F>* params) {
  const MaskOf<F> lies = anisotropic<F>(kind);
  if (!any(lies)) return;
  const Frame<F> frame(ns);
  const Vec3<F> tangent =
      frame.to_local(unit_tangent(lobe_tangents<F>(scene, material, mask_and(active, lies), surface), ns));
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
