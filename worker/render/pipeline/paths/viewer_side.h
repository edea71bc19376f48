#pragma once
// Shading normals that face away from the camera's side of a path.
//
// Where a surface is seen at a grazing angle, its shading normal may face away from a viewer that the surface
// itself faces. No BSDF has a value there: normal maps would get black spots, coarse smooth meshes black
// rims. So the direction towards the camera is mirrored at the plane of the shading normal. Then the BSDF
// sees it on the side that the geometry says. The light's side of the path is left as it is: light from
// behind either normal does not count.
//
// Two directions of the sphere may thus be one to the BSDF. Camera paths sample the other side of the event
// and need not care. Light paths sample the camera's side, and take either of a pair with probability 1/2.
// All strategies estimate the same integral, with the densities that `viewer_density` corrects.
#include "worker/render/pipeline/paths/vertex_io.h"

namespace lightmill {

/// `local`, a direction towards the camera in the shading frame, as the BSDF is to see it. `cos_g`: its
/// cosine to the geometric normal.
template <class F>
inline Vec3<F> viewer_direction(const Vec3<F>& local, F cos_g) {
  return {local.x, local.y, copysign(local.z, cos_g)};
}

/// Whether the mirror image of a direction lies on the same side of the surface. `z`, `cos_g`: the
/// direction's cosines to the shading and the geometric normal. `tilt`: ng . ns.
template <class F>
inline MaskOf<F> has_mirror_image(F z, F cos_g, F tilt) {
  return MaskOf<F>(cos_g * (cos_g - 2.0f * z * tilt) > 0.0f);
}

/// The probability with which light paths keep a direction towards the camera rather than take its mirror
/// image.
template <class F>
inline F viewer_density(F z, F cos_g, F tilt) {
  return select(has_mirror_image(z, cos_g, tilt), splat<F>(0.5f), splat<F>(1.0f));
}

/// The same at vertex `v`, for the world direction `w`.
template <class F>
inline F viewer_density(const VertexLanes<F>& v, const Vec3<F>& w) {
  return viewer_density(dot(v.ns, w), dot(v.ng, w), dot(v.ns, v.ng));
}

}  // namespace lightmill
