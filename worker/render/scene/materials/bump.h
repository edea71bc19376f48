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

}  // namespace lightmill
