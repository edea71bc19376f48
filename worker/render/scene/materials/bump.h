#pragma once
// Normal maps and bump maps: textures that tilt the shading normal and nothing else.
#include "worker/render/scene/geometry/surface.h"

namespace lightmill {

inline bool has_bumps(const MaterialEntry& m) {
  return m.normal_map >= 0 || m.displacement >= 0 || m.shading_normal >= 0;
}

/// Step of u and v for the slopes of a bump map: that of pbrt-v4 where it has no ray differentials.
inline constexpr float kBumpStep = 0.0005f;

/// The shading normal of surface `s` after the maps of its material, which has_bumps: unit, on the side of
/// s.ng. First comes the graph's normal, as it is, or the normal map: the texture's 2 rgb - 1 with x along
/// dp/du, z along the normal, and y their cross product (or, if the map follows v, that side of it on which
/// dp/dv lies). Then the bump map: the normal of the surface lifted along that normal by the texture (Blinn
/// 1978, without the term of the surface's curvature), by forward differences. If the bump is by pixel, the
/// steps are as wide as a pixel of the camera is at the point, so that what is finer does not tilt it, as in
/// Cycles. A map that gives no direction leaves the normal as it is.
Vec3<float> bumped_normal(const RenderScene& scene, const MaterialEntry& material, const Surface<float>& s);

/// The same in lanes: where an active lane's material has a map, else s.ns.
template <class F>
inline Vec3<F> bumped_normals(const RenderScene& scene, IntOf<F> material, MaskOf<F> active,
                              const Surface<F>& s) {
  float ns[3][8];
  store(ns[0], s.ns.x), store(ns[1], s.ns.y), store(ns[2], s.ns.z);
  bool changed = false;
  for (unsigned bits = mask_bits(active); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    const MaterialEntry& m = scene.materials[static_cast<size_t>(lane(material, l))];
    if (!has_bumps(m)) continue;
    const auto vec = [&](const Vec3<F>& a) { return Vec3<float>{lane(a.x, l), lane(a.y, l), lane(a.z, l)}; };
    Surface<float> one;
    one.p = vec(s.p);
    one.ng = vec(s.ng);
    one.ns = vec(s.ns);
    one.u = lane(s.u, l);
    one.v = lane(s.v, l);
    one.dpdu = vec(s.dpdu);
    one.dpdv = vec(s.dpdv);
    one.rays = s.rays ? s.rays + l : nullptr;
    const Vec3<float> n = bumped_normal(scene, m, one);
    ns[0][l] = n.x, ns[1][l] = n.y, ns[2][l] = n.z;
    changed = true;
  }
  return changed ? Vec3<F>{load<F>(ns[0]), load<F>(ns[1]), load<F>(ns[2])} : s.ns;
}

/// Whether the material's normals turn to whoever looks at them, as Blender's bumps do. Only camera paths
/// know the viewer.
inline bool faces_viewer(const MaterialEntry& m) { return m.bump_by_pixel && m.displacement >= 0; }

/// `ns` turned towards `ng`, as far as it takes for the mirror image of `wo` to be above the surface (by a
/// hundredth, or nearly as far as wo is). All are unit vectors; ng and ns are on the side of wo.
template <class F>
inline Vec3<F> reflecting_normal(const Vec3<F>& ns, const Vec3<F>& ng, const Vec3<F>& wo) {
  const F height = dot(wo, ng);
  const F least = min(height * 0.9f, splat<F>(0.01f));
  const MaskOf<F> below = MaskOf<F>(dot(wo, ns) * 2.0f * dot(ns, ng) - height < least);
  if (!any(below)) return ns;
  // In the plane of ng and ns, ns being at the angle x from ng, the mirror image's height is
  // |w| cos(2 x - d), w being wo in that plane and d its own angle.
  const Vec3<F> across = ns - ng * dot(ns, ng);
  const F across2 = dot(across, across);
  const MaskOf<F> tilted = MaskOf<F>(across2 > 1e-12f);
  const Vec3<F> axis = across * (1.0f / sqrt(select(tilted, across2, splat<F>(1.0f))));
  const F along = dot(wo, axis);
  const F inv = 1.0f / sqrt(max(along * along + height * height, splat<F>(1e-20f)));
  const F cos_d = height * inv, sin_d = along * inv, c = min(least * inv, splat<F>(1.0f));
  const F cos_2x = clamp(cos_d * c - sin_d * sqrt(max(1.0f - c * c, F{})), -1.0f, 1.0f);
  const Vec3<F> turned = ng * sqrt((1.0f + cos_2x) * 0.5f) + axis * sqrt((1.0f - cos_2x) * 0.5f);
  return select(mask_and(below, tilted), turned, ns);
}

/// The shading normals of the lanes as camera paths that come from `wo` have them.
template <class F>
inline Vec3<F> normals_to_viewer(const RenderScene& scene, IntOf<F> material, MaskOf<F> active,
                                 const Vec3<F>& ns, const Vec3<F>& ng, const Vec3<F>& wo) {
  float turns[8] = {};
  for (unsigned bits = mask_bits(active); bits; bits &= bits - 1) {
    const int l = std::countr_zero(bits);
    turns[l] = faces_viewer(scene.materials[static_cast<size_t>(lane(material, l))]) ? 1.0f : 0.0f;
  }
  const MaskOf<F> turned = MaskOf<F>(load<F>(turns) > 0.0f);
  if (!any(turned)) return ns;
  const F side = copysign(splat<F>(1.0f), dot(ng, wo));
  return select(turned, reflecting_normal<F>(ns * side, ng * side, wo) * side, ns);
}

}  // namespace lightmill
