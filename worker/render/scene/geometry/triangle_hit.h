#pragma once
// Where a ray meets a triangle that it is known to hit: vertices, barycentrics, texture coordinates and their
// derivatives. By our own arithmetic alone, so that all callers get the same bits: the surface
// reconstruction, and the alpha masks inside the ray tracing library's callbacks.
#include "worker/render/scene/render_scene.h"

namespace lightmill {

template <class F>
struct TriangleHit {
  IntOf<F> i0, i1, i2;  // vertices
  Vec3<F> p0, p1, p2;   // their positions
  Vec3<F> e1, e2;       // p1 - p0, p2 - p0
  F b0{}, b1{}, b2{};   // barycentrics in [0, 1]
};

/// Where bending meshes are between two blocks of their vertices.
template <class F>
struct BendStep {
  IntOf<F> from{},
      block{};  // what to add to a vertex's number for the one before, and from there to the next
  F part{};     // of the way

  /// Of triangles `tri` at `time` in [0, 1]; scene.any_bending().
  BendStep(const RenderScene& scene, IntOf<F> tri, F time) {
    static_assert(sizeof(MeshBend) == 2 * sizeof(int32_t));
    const IntOf<F> bend = gather(scene.triangle_bend.data(), tri) * 2;
    block = gather(&scene.bends.data()->vertices, bend);
    const IntOf<F> segments = gather(&scene.bends.data()->segments, bend);
    const F at = time * to_float(segments);  // exact: a power of two
    const IntOf<F> whole = to_int(at), last = segments - 1;
    const IntOf<F> step = select(MaskOf<F>(whole < last), whole, last);
    from = step * block;
    part = at - to_float(step);
  }
  /// Of three floats per vertex. `size`, if given, gets as much as their interpolation rounds.
  Vec3<F> at(const float* base, IntOf<F> vertex, Vec3<F>* size = nullptr) const {
    const Vec3<F> a = gather3<F>(base, vertex + from), b = gather3<F>(base, vertex + from + block);
    if (size) {
      const Vec3<F> both{abs(a.x) + abs(b.x), abs(a.y) + abs(b.y), abs(a.z) + abs(b.z)};
      *size = select(MaskOf<F>(block > 0), both, Vec3<F>{});
    }
    return a + (b - a) * part;
  }
};

/// From the corners' positions.
template <class F>
inline void finish_hit(const Vec3<F>& o, const Vec3<F>& d, TriangleHit<F>* hit) {
  TriangleHit<F>& h = *hit;
  h.e1 = h.p1 - h.p0, h.e2 = h.p2 - h.p0;
  // Moller & Trumbore 1997.
  const Vec3<F> q = cross(d, h.e2);
  const F det = dot(h.e1, q);
  const F inv = 1.0f / select(MaskOf<F>(det == 0.0f), splat<F>(1.0f), det);
  const Vec3<F> w = o - h.p0;
  h.b1 = clamp(dot(w, q) * inv, 0.0f, 1.0f);
  h.b2 = min(max(dot(d, cross(w, h.e1)) * inv, F{}), 1.0f - h.b1);
  h.b0 = 1.0f - h.b1 - h.b2;
}

/// The hit of ray (o, d) with the plane of triangles `tri`, clamped into the triangle.
template <class F>
inline TriangleHit<F> triangle_hit(const RenderScene& scene, IntOf<F> tri, const Vec3<F>& o,
                                   const Vec3<F>& d) {
  TriangleHit<F> h;
  F corners[3];
  load_triples(reinterpret_cast<const float*>(scene.indices.data()), tri * 3, corners);
  h.i0 = as_int(float_bits(corners[0])), h.i1 = as_int(float_bits(corners[1])),
  h.i2 = as_int(float_bits(corners[2]));
  const float* pos = scene.positions.data();
  h.p0 = gather3<F>(pos, h.i0), h.p1 = gather3<F>(pos, h.i1), h.p2 = gather3<F>(pos, h.i2);
  finish_hit(o, d, &h);
  return h;
}
/// The same of triangles that may bend. `size` gets, per corner, as much as bending rounds.
template <class F>
inline TriangleHit<F> bent_triangle_hit(const RenderScene& scene, IntOf<F> tri, const Vec3<F>& o,
                                        const Vec3<F>& d, const BendStep<F>& step, Vec3<F> size[3]) {
  TriangleHit<F> h;
  const int32_t* corner = scene.indices.data();
  h.i0 = gather(corner, tri * 3), h.i1 = gather(corner + 1, tri * 3), h.i2 = gather(corner + 2, tri * 3);
  const float* pos = scene.positions.data();
  h.p0 = step.at(pos, h.i0, &size[0]), h.p1 = step.at(pos, h.i1, &size[1]),
  h.p2 = step.at(pos, h.i2, &size[2]);
  finish_hit(o, d, &h);
  return h;
}

/// Vertex colours at the hit, RGB and alpha; scene.any_colors.
template <class F>
inline void interpolate_colors(const RenderScene& scene, const TriangleHit<F>& h, F color[4]) {
  for (int c = 0; c < 4; ++c) {
    const float* base = scene.colors.data() + c;
    color[c] = gather(base, h.i0 * 4) * h.b0 + gather(base, h.i1 * 4) * h.b1 + gather(base, h.i2 * 4) * h.b2;
  }
}

/// The second set of texture coordinates at the hit; scene.any_second_uvs.
template <class F>
inline void interpolate_second_uvs(const RenderScene& scene, const TriangleHit<F>& h, F* u, F* v) {
  const auto at = [&](const float* base) {
    return gather(base, h.i0 * 2) * h.b0 + gather(base, h.i1 * 2) * h.b1 + gather(base, h.i2 * 2) * h.b2;
  };
  *u = at(scene.second_uvs.data());
  *v = at(scene.second_uvs.data() + 1);
}

/// Texture coordinates of the three corners. Without coordinates a triangle has (0,0), (1,0), (1,1).
template <class F>
struct CornerUv {
  F u0{}, v0{}, u1{}, v1{}, u2{}, v2{};
  CornerUv(const RenderScene& scene, const TriangleHit<F>& h, IntOf<F> flags) {
    u1 = u2 = v2 = splat<F>(1.0f);
    const MaskOf<F> has_uv = MaskOf<F>((flags & RenderScene::kHasUv) != 0);
    if (!any(has_uv)) return;
    const float* uv = scene.uvs.data();
    u0 = select(has_uv, gather(uv, h.i0 * 2), u0), v0 = select(has_uv, gather(uv + 1, h.i0 * 2), v0);
    u1 = select(has_uv, gather(uv, h.i1 * 2), u1), v1 = select(has_uv, gather(uv + 1, h.i1 * 2), v1);
    u2 = select(has_uv, gather(uv, h.i2 * 2), u2), v2 = select(has_uv, gather(uv + 1, h.i2 * 2), v2);
  }
  F u(const TriangleHit<F>& h) const { return u0 * h.b0 + u1 * h.b1 + u2 * h.b2; }
  F v(const TriangleHit<F>& h) const { return v0 * h.b0 + v1 * h.b1 + v2 * h.b2; }
};

/// dp/du and dp/dv of the triangle. If its coordinates do not span the plane: two edges' worth of an
/// arbitrary basis of it.
template <class F>
inline void triangle_derivatives(const TriangleHit<F>& h, const CornerUv<F>& uv, Vec3<F>* dpdu,
                                 Vec3<F>* dpdv) {
  const F du1 = uv.u1 - uv.u0, dv1 = uv.v1 - uv.v0, du2 = uv.u2 - uv.u0, dv2 = uv.v2 - uv.v0;
  const F det = du1 * dv2 - du2 * dv1;
  const F inv = 1.0f / select(MaskOf<F>(det == 0.0f), splat<F>(1.0f), det);
  const Vec3<F> a = (h.e1 * dv2 - h.e2 * dv1) * inv, b = (h.e2 * du1 - h.e1 * du2) * inv;
  // Compared so that NaN and overflow fall back, too; the squares must be in range.
  const auto usable = [](const Vec3<F>& x) {
    const F n2 = dot(x, x);
    return mask_and(MaskOf<F>(n2 > 0x1p-120f), MaskOf<F>(n2 < 0x1p120f));
  };
  const MaskOf<F> spans = mask_and(MaskOf<F>(det != 0.0f), mask_and(usable(a), usable(b)));
  *dpdu = select(spans, a, h.e1);
  *dpdv = select(spans, b, h.e2);
}

}  // namespace lightmill
