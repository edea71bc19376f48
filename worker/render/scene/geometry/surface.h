#pragma once
// Surface points: from (primitive, ray) to position, error bound, normals and BSDF parameters.
//
// The acceleration structure only names the primitive. Distance, barycentrics and position are recomputed
// here by our own arithmetic, because its reciprocal estimates round differently between CPU vendors.
#include <optional>
#include <type_traits>

#include "worker/render/math/angle.h"
#include "worker/render/math/ray_offset.h"
#include "worker/render/scene/geometry/placement.h"
#include "worker/render/scene/geometry/sphere_hit.h"
#include "worker/render/scene/geometry/triangle_hit.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

template <class F>
struct Surface {
  Vec3<F> p;   // on the primitive
  F error{};   // bound of |p - true point| per component
  Vec3<F> ng;  // unit geometric normal, to the surface's outside
  Vec3<F> ns;  // unit shading normal, same orientation
  F u{}, v{};  // texture coordinates
  // Derivatives of the position by u and v if scene.any_tangent (dpdu is zero at a sphere's
  // poles); else zero.
  Vec3<F> dpdu, dpdv;
  F color[4]{};                      // of the vertices, with alpha, if scene.any_colors
  F second_u{}, second_v{};          // if scene.any_second_uvs
  const RayAtPoint* rays = nullptr;  // of the lanes that met it, where textures ask for them
};

/// The unit tangent along +u: dp/du made perpendicular to the unit normal `n` (the shading normal in use).
template <class F>
inline Vec3<F> unit_tangent(const Vec3<F>& dpdu, const Vec3<F>& n) {
  const Vec3<F> t = dpdu - n * dot(dpdu, n);
  const F t2 = dot(t, t);
  // Along the normal there is no direction to choose by.
  const MaskOf<F> usable = MaskOf<F>(t2 > dot(dpdu, dpdu) * 1e-12f);
  return select(usable, t * (1.0f / sqrt(select(usable, t2, splat<F>(1.0f)))), Frame<F>(n).s);
}

/// See surface_at; the ray is (world_o, world_d) before `place` takes it to the primitive's space.
template <class F, bool kAnySurface, class Place>
inline Surface<F> placed_surface(const RenderScene& scene, IntOf<F> prim, const Place& place,
                                 const Vec3<F>& world_o, const Vec3<F>& world_d, F time = F{}) {
  Surface<F> s;
  const Vec3<F> o = place.origin(world_o), d = place.direction(world_d);
  const int32_t triangles = scene.triangle_count();
  const MaskOf<F> is_sphere = MaskOf<F>(prim >= triangles);
  const bool spheres = any(is_sphere);
  const IntOf<F> flags = gather(scene.primitive_flags.data(), prim);
  // Constants in kernels that have no such surfaces.
  const bool colors = kAnySurface && scene.any_colors, tangent = kAnySurface && scene.any_tangent,
             coordinates = kAnySurface && (scene.any_texture || scene.any_tangent || scene.records_uvs);
  const F flip = select(MaskOf<F>((flags & RenderScene::kFlip) != 0), splat<F>(-1.0f), splat<F>(1.0f));
  if (triangles > 0) {
    const IntOf<F> tri = spheres ? select(is_sphere, IntOf<F>{}, prim) : prim;
    // What bends is in instances.
    constexpr bool kMayBend = !std::is_same_v<Place, NoPlacement<F>>;
    const bool bends = kMayBend && scene.any_bending();
    std::optional<BendStep<F>> step;
    if (bends) step.emplace(scene, tri, time);
    Vec3<F> rounded[3];
    TriangleHit<F> h =
        bends ? bent_triangle_hit<F>(scene, tri, o, d, *step, rounded) : triangle_hit<F>(scene, tri, o, d);
    const F b0 = h.b0, b1 = h.b1, b2 = h.b2;
    const Vec3<F> p = h.p0 * b0 + h.p1 * b1 + h.p2 * b2;
    s.p = place.point(p);
    // |p| error <= gamma_7 sum |b_i p_i| (pbrt-v4 §6.8.1); one bound for all three axes.
    auto bound = [&](F a, F b, F c) { return abs(a * b0) + abs(b * b1) + abs(c * b2); };
    Vec3<F> error{bound(h.p0.x, h.p1.x, h.p2.x), bound(h.p0.y, h.p1.y, h.p2.y),
                  bound(h.p0.z, h.p1.z, h.p2.z)};
    // The corners of what bends are rounded, too, here and in the ray tracing library: three operations each.
    if (bends) {
      error = error + Vec3<F>{bound(rounded[0].x, rounded[1].x, rounded[2].x),
                              bound(rounded[0].y, rounded[1].y, rounded[2].y),
                              bound(rounded[0].z, rounded[1].z, rounded[2].z)};
    }
    s.error = place.error(error, gamma_bound(7), p);
    s.ng = place.handed(normalize(cross(place.scaled_vector(h.e1), place.scaled_vector(h.e2))) * flip);
    s.ns = s.ng;
    if (scene.any_normals) {
      const float* nor = scene.normals.data();
      const auto at = [&](IntOf<F> vertex) {
        return bends ? step->at(nor, vertex) : gather3<F>(nor, vertex);
      };
      const Vec3<F> n =
          place.normal(at(h.i0)) * b0 + place.normal(at(h.i1)) * b1 + place.normal(at(h.i2)) * b2;
      const F n2 = dot(n, n);
      const MaskOf<F> smooth = MaskOf<F>(n2 > 0.0f);
      const Vec3<F> unit = n * (1.0f / sqrt(select(smooth, n2, splat<F>(1.0f))));
      // The shading normal decides the orientation where there is one (pbrt-v4 §6.5.3).
      const F agree = copysign(splat<F>(1.0f), dot(unit, s.ng));
      s.ng = select(smooth, s.ng * agree, s.ng);
      s.ns = select(smooth, unit, s.ng);
    }
    if (colors) interpolate_colors(scene, h, s.color);
    if (kAnySurface && scene.any_second_uvs) interpolate_second_uvs(scene, h, &s.second_u, &s.second_v);
    if (coordinates) {
      const CornerUv<F> uv(scene, h, flags);
      s.u = uv.u(h);
      s.v = uv.v(h);
      if (tangent) {
        h.e1 = place.vector(h.e1), h.e2 = place.vector(h.e2);
        triangle_derivatives(h, uv, &s.dpdu, &s.dpdv);
      }
    }
  }
  if (spheres) {
    const IntOf<F> index = select(is_sphere, prim - triangles, IntOf<F>{}) * 4;
    const float* base = scene.spheres.data();
    const Vec3<F> center{gather(base, index), gather(base + 1, index), gather(base + 2, index)};
    const F radius = gather(base + 3, index);
    using D = DoubleOf<F>;
    D out[3][kDoubleParts<F>];
    for (int part = 0; part < kDoubleParts<F>; ++part) {
      const auto wide = [&](const Vec3<F>& v) {
        return Vec3<D>{to_double(v.x, part), to_double(v.y, part), to_double(v.z, part)};
      };
      const Vec3<D> from = wide(o), along = wide(d), c = wide(center);
      const D t = sphere_hit<D>(from - c, along, to_double(radius, part), D{}, D{} + 1e300);
      // Offset from the centre, renormalised onto the sphere.
      const Vec3<D> x = from + along * t - c;
      const D length = sqrt(dot(x, x));
      const MaskOf<D> some = MaskOf<D>(length > 0.0);
      const D f = select(some, 1.0 / length, D{});
      out[0][part] = x.x * f, out[1][part] = x.y * f, out[2][part] = select(some, x.z * f, D{} + 1.0);
    }
    const Vec3<F> n{from_double(out[0]), from_double(out[1]), from_double(out[2])};
    const Vec3<F> p = center + n * radius;
    s.p = select(is_sphere, place.point(p), s.p);
    const F size = max(abs(center.x), max(abs(center.y), abs(center.z))) + radius;
    s.error = select(is_sphere, place.error({size, size, size}, gamma_bound(5), p), s.error);
    const Vec3<F> outward = place.normal(n) * flip;
    s.ng = select(is_sphere, outward, s.ng);
    s.ns = select(is_sphere, outward, s.ns);
    if (colors) {
      for (F& c : s.color) c = select(is_sphere, splat<F>(1.0f), c);
    }
    if (coordinates) {
      const IntOf<F> sphere = select(is_sphere, prim - triangles, IntOf<F>{}) * 3;
      const float* axes = scene.sphere_axes.data();
      const Vec3<F> ax = gather3<F>(axes, sphere), ay = gather3<F>(axes, sphere + 1),
                    az = gather3<F>(axes, sphere + 2);
      const F x = dot(n, ax), y = dot(n, ay), z = dot(n, az);
      const F sine = sqrt(x * x + y * y);
      F u, v;
      sphere_uv(x, y, z, &u, &v);
      s.u = select(is_sphere, u, s.u);
      s.v = select(is_sphere, v, s.v);
      if (tangent) {
        const F around = 2.0f * kPi * radius, along = kPi * radius;
        // v grows towards +z; at the poles dp/du is zero and dp/dv is along x.
        const MaskOf<F> pole = MaskOf<F>(sine == 0.0f);
        const F inv = 1.0f / select(pole, splat<F>(1.0f), sine);
        const F c = select(pole, splat<F>(1.0f), x * inv), d = select(pole, F{}, y * inv);
        s.dpdu = select(is_sphere, place.vector((ay * x - ax * y) * around), s.dpdu);
        s.dpdv = select(is_sphere, place.vector((az * sine - (ax * c + ay * d) * z) * along), s.dpdv);
      }
    }
  }
  return s;
}

/// Reconstructs the hit of ray (o, d) with primitives `prim` (all valid indices) of instances `instance` (-1:
/// of the world itself), at `time` in [0, 1].
template <class F, bool kAnySurface = true>
inline Surface<F> surface_at(const RenderScene& scene, IntOf<F> prim, IntOf<F> instance, const Vec3<F>& o,
                             const Vec3<F>& d, F time = F{}) {
  if (kAnySurface && scene.any_instances() && any(MaskOf<F>(instance >= 0)))
    return placed_surface<F, kAnySurface>(scene, prim, Placement<F>::at(scene, instance, time), o, d, time);
  return placed_surface<F, kAnySurface>(scene, prim, NoPlacement<F>{}, o, d);
}
template <class F>
inline Surface<F> surface_at(const RenderScene& scene, IntOf<F> prim, const Vec3<F>& o, const Vec3<F>& d) {
  return placed_surface<F, true>(scene, prim, NoPlacement<F>{}, o, d);
}

/// The point of texture look-ups in lane `l` of `s`.
template <class F>
inline TexturePoint texture_point(const RenderScene& scene, const Surface<F>& s, int l) {
  TexturePoint at{lane(s.u, l), lane(s.v, l),
                  scene.scene_point({lane(s.p.x, l), lane(s.p.y, l), lane(s.p.z, l)})};
  at.n = {lane(s.ng.x, l), lane(s.ng.y, l), lane(s.ng.z, l)};
  if (scene.any_colors) {
    for (size_t c = 0; c < 4; ++c) at.color[c] = lane(s.color[c], l);
  }
  if (scene.any_second_uvs) at.second_u = lane(s.second_u, l), at.second_v = lane(s.second_v, l);
  at.ray = s.rays ? s.rays + l : nullptr;
  if (scene.textures.any_graph()) at.ns = {lane(s.ns.x, l), lane(s.ns.y, l), lane(s.ns.z, l)};
  return at;
}

/// Begins to fetch what apply_textures will read, as far as that is quickly found.
void prefetch_textures(const RenderScene& scene, const MaterialEntry& material, const TexturePoint& at);
/// Evaluates the graphs that `materials` read in the lanes of `mask`'s bits, all at once; at[l].known are the
/// values.
void evaluate_graphs(const RenderScene& scene, const int32_t materials[8], unsigned mask, TexturePoint at[8],
                     KnownValues known[8]);
/// Overwrites the parameters of a textured material at one point.
void apply_textures(const RenderScene& scene, int32_t material, const TexturePoint& at, float* params);

/// BSDF kind and parameters of `material` at the points of `s`.
template <class F, bool kAnySurface = true>
inline IntOf<F> bsdf_at(const RenderScene& scene, IntOf<F> material, MaskOf<F> active, const Surface<F>& s,
                        BsdfParams<F>* params) {
  params->tables = scene.bsdf_tables.data();
  const IntOf<F> offset = material * kBsdfParams;
  if constexpr (!kAnySurface) {
    load_triples(scene.material_params.data(), offset, params->p);
    return splat_int<F>(kDiffuse);
  }
  load_octets(scene.material_params.data(), offset, params->p);
  for (int i = 8; i < kBsdfParams; ++i) params->p[i] = gather(scene.material_params.data() + i, offset);
  if (scene.any_texture) {
    float p[kBsdfParams][8];
    for (int i = 0; i < kBsdfParams; ++i) store(p[i], params->p[i]);
    unsigned textured = 0;
    TexturePoint at[8];
    for (int l = 0; l < kWidth<F>; ++l) {
      const MaterialEntry& m = scene.materials[static_cast<size_t>(lane(material, l))];
      if (!(mask_bits(active) >> l & 1) || !m.textured) continue;
      textured |= 1u << l;
      at[l] = texture_point(scene, s, l);
      // Texels are far away: the fetches of all lanes begin before the first one is needed.
      prefetch_textures(scene, m, at[l]);
    }
    KnownValues known[8];
    if (kWidth<F> == 8 && textured && scene.textures.any_graph()) {
      int32_t materials[8];
      store(materials, material);
      evaluate_graphs(scene, materials, textured, at, known);
    }
    for (unsigned left = textured; left; left &= left - 1) {
      const int l = std::countr_zero(left);
      float one[kBsdfParams];
      for (int i = 0; i < kBsdfParams; ++i) one[i] = p[i][l];
      apply_textures(scene, lane(material, l), at[l], one);
      for (int i = 0; i < kBsdfParams; ++i) p[i][l] = one[i];
    }
    if (textured) {
      for (int i = 0; i < kBsdfParams; ++i) params->p[i] = load<F>(p[i]);
    }
  }
  return gather(scene.material_kind.data(), material);
}

}  // namespace lightmill
