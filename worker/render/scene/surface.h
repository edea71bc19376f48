#pragma once
// Surface points: from (primitive, ray) to position, error bound, normals and BSDF parameters.
//
// The acceleration structure only names the primitive; distance, barycentrics and position are recomputed
// here by our own arithmetic, because its reciprocal estimates round differently between CPU vendors.
#include "worker/render/math/ray_offset.h"
#include "worker/render/scene/render_scene.h"
#include "worker/render/scene/sphere_hit.h"

namespace lightmill {

template <class F>
struct Surface {
  Vec3<F> p;   // on the primitive
  F error{};   // bound of |p - true point| per component
  Vec3<F> ng;  // unit geometric normal, to the surface's outside
  Vec3<F> ns;  // unit shading normal, same orientation
  F u{}, v{};  // texture coordinates
};

/// Reconstructs the hit of ray (o, d) with primitives `prim` (all valid indices).
template <class F>
inline Surface<F> surface_at(const RenderScene& scene, IntOf<F> prim, const Vec3<F>& o, const Vec3<F>& d) {
  Surface<F> s;
  const int32_t triangles = scene.triangle_count();
  const MaskOf<F> is_sphere = MaskOf<F>(prim >= triangles);
  const bool spheres = any(is_sphere);
  const IntOf<F> flags = gather(scene.primitive_flags.data(), prim);
  const F flip = select(MaskOf<F>((flags & RenderScene::kFlip) != 0), splat<F>(-1.0f), splat<F>(1.0f));
  if (triangles > 0) {
    const IntOf<F> tri = spheres ? select(is_sphere, IntOf<F>{}, prim) : prim;
    const IntOf<F> i3 = tri * 3;
    const IntOf<F> i0 = gather(scene.indices.data(), i3), i1 = gather(scene.indices.data() + 1, i3),
                   i2 = gather(scene.indices.data() + 2, i3);
    const float* pos = scene.positions.data();
    const Vec3<F> p0 = gather3<F>(pos, i0), p1 = gather3<F>(pos, i1), p2 = gather3<F>(pos, i2);
    const Vec3<F> e1 = p1 - p0, e2 = p2 - p0;
    // Moller & Trumbore 1997.
    const Vec3<F> q = cross(d, e2);
    const F det = dot(e1, q);
    const F inv = 1.0f / select(MaskOf<F>(det == 0.0f), splat<F>(1.0f), det);
    const Vec3<F> w = o - p0;
    const F b1 = clamp(dot(w, q) * inv, 0.0f, 1.0f);
    const F b2 = min(max(dot(d, cross(w, e1)) * inv, F{}), 1.0f - b1);
    const F b0 = 1.0f - b1 - b2;
    s.p = p0 * b0 + p1 * b1 + p2 * b2;
    // |p| error <= gamma_7 sum |b_i p_i| (pbrt-v4 §6.8.1); one bound for all three axes.
    auto bound = [&](F a, F b, F c) { return abs(a * b0) + abs(b * b1) + abs(c * b2); };
    s.error =
        max(bound(p0.x, p1.x, p2.x), max(bound(p0.y, p1.y, p2.y), bound(p0.z, p1.z, p2.z))) * gamma_bound(7);
    s.ng = normalize(cross(e1, e2)) * flip;
    s.ns = s.ng;
    if (scene.any_normals) {
      const float* nor = scene.normals.data();
      const Vec3<F> n = gather3<F>(nor, i0) * b0 + gather3<F>(nor, i1) * b1 + gather3<F>(nor, i2) * b2;
      const F n2 = dot(n, n);
      const MaskOf<F> smooth = MaskOf<F>(n2 > 0.0f);
      const Vec3<F> unit = n * (1.0f / sqrt(select(smooth, n2, splat<F>(1.0f))));
      // The shading normal decides the orientation where there is one (pbrt-v4 §6.5.3).
      const F agree = copysign(splat<F>(1.0f), dot(unit, s.ng));
      s.ng = select(smooth, s.ng * agree, s.ng);
      s.ns = select(smooth, unit, s.ng);
    }
    if (scene.any_texture) {
      const MaskOf<F> has_uv = MaskOf<F>((flags & RenderScene::kHasUv) != 0);
      // Without coordinates a triangle has (0,0), (1,0), (1,1).
      s.u = b1 + b2;
      s.v = b2;
      if (any(has_uv)) {
        const float* uv = scene.uvs.data();
        const F u = gather(uv, i0 * 2) * b0 + gather(uv, i1 * 2) * b1 + gather(uv, i2 * 2) * b2;
        const F v = gather(uv + 1, i0 * 2) * b0 + gather(uv + 1, i1 * 2) * b1 + gather(uv + 1, i2 * 2) * b2;
        s.u = select(has_uv, u, s.u);
        s.v = select(has_uv, v, s.v);
      }
    }
  }
  if (spheres) {
    const IntOf<F> index = select(is_sphere, prim - triangles, IntOf<F>{}) * 4;
    const float* base = scene.spheres.data();
    const Vec3<F> center{gather(base, index), gather(base + 1, index), gather(base + 2, index)};
    const F radius = gather(base + 3, index);
    Vec3<F> p = center;
    float out[3][8];
    for (int l = 0; l < kWidth<F>; ++l) {
      const float lo[3] = {lane(o.x, l), lane(o.y, l), lane(o.z, l)};
      const float ld[3] = {lane(d.x, l), lane(d.y, l), lane(d.z, l)};
      const float sphere[4] = {lane(center.x, l), lane(center.y, l), lane(center.z, l), lane(radius, l)};
      const double t = sphere_hit(lo, ld, sphere, 0, 1e300);
      // Offset from the centre, renormalised onto the sphere.
      double x = lo[0] + t * ld[0] - sphere[0], y = lo[1] + t * ld[1] - sphere[1],
             z = lo[2] + t * ld[2] - sphere[2];
      const double n = std::sqrt(x * x + y * y + z * z);
      const double f = n > 0 ? 1 / n : 0;
      out[0][l] = static_cast<float>(x * f);
      out[1][l] = static_cast<float>(y * f);
      out[2][l] = static_cast<float>(n > 0 ? z * f : 1);
    }
    const Vec3<F> n{load<F>(out[0]), load<F>(out[1]), load<F>(out[2])};
    p = center + n * radius;
    s.p = select(is_sphere, p, s.p);
    const F size = max(abs(center.x), max(abs(center.y), abs(center.z))) + radius;
    s.error = select(is_sphere, size * gamma_bound(5), s.error);
    s.ng = select(is_sphere, n * flip, s.ng);
    s.ns = select(is_sphere, n * flip, s.ns);
  }
  return s;
}

/// BSDF kind and parameters of `material` at texture coordinates (u, v).
template <class F>
inline IntOf<F> bsdf_at(const RenderScene& scene, IntOf<F> material, MaskOf<F> active, F u, F v,
                        BsdfParams<F>* params);

/// Overwrites the parameters of a textured material at one point.
void apply_textures(const RenderScene& scene, int32_t material, float u, float v, float* params);

template <class F>
inline IntOf<F> bsdf_at(const RenderScene& scene, IntOf<F> material, MaskOf<F> active, F u, F v,
                        BsdfParams<F>* params) {
  const IntOf<F> offset = material * kBsdfParams;
  for (int i = 0; i < kBsdfParams; ++i) params->p[i] = gather(scene.material_params.data() + i, offset);
  if (scene.any_texture) {
    float p[kBsdfParams][8];
    for (int i = 0; i < kBsdfParams; ++i) store(p[i], params->p[i]);
    const unsigned bits = mask_bits(active);
    bool changed = false;
    for (int l = 0; l < kWidth<F>; ++l) {
      const int32_t m = lane(material, l);
      if (!(bits >> l & 1) || !scene.materials[static_cast<size_t>(m)].textured) continue;
      float one[kBsdfParams];
      for (int i = 0; i < kBsdfParams; ++i) one[i] = p[i][l];
      apply_textures(scene, m, lane(u, l), lane(v, l), one);
      for (int i = 0; i < kBsdfParams; ++i) p[i][l] = one[i];
      changed = true;
    }
    if (changed) {
      for (int i = 0; i < kBsdfParams; ++i) params->p[i] = load<F>(p[i]);
    }
  }
  return gather(scene.material_kind.data(), material);
}

}  // namespace lightmill
