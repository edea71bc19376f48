#pragma once
// Ray-sphere intersection in double. The acceleration structure's callback and the surface reconstruction
// share it, so both find the same root.
#include "worker/render/math/angle.h"
#include "worker/render/math/vec.h"

namespace lightmill {

/// Smallest t in (tnear, tfar) at which the ray from `from`, relative to the sphere's centre, meets the
/// sphere, or a negative number. D is double or lanes of it. The discriminant comes from the perpendicular
/// distance, which does not cancel for far-away spheres (Hearn & Baker; Haines et al., "Precision
/// Improvements for Ray/Sphere Intersection", 2019).
template <class D>
inline D sphere_hit(const Vec3<D>& from, const Vec3<D>& d, D r, D tnear, D tfar) {
  const D none = D{} - 1.0;
  const D a = dot(d, d);
  const D b = -dot(from, d);
  const Vec3<D> p = from + d * (b / a);
  const D discriminant = r * r - dot(p, p);  // below 0 its root, and so every t, is NaN
  const D c = dot(from, from) - r * r;
  const D q = b + copysign(sqrt(a * discriminant), b);
  const D u = select(MaskOf<D>(q == 0.0), D{}, c / q), v = q / a;
  const MaskOf<D> swapped = MaskOf<D>(u > v);
  const D t0 = select(swapped, v, u), t1 = select(swapped, u, v);
  const auto within = [&](D t) { return mask_and(MaskOf<D>(t > tnear), MaskOf<D>(t < tfar)); };
  return select(within(t0), t0, select(within(t1), t1, none));
}
inline double sphere_hit(const float o[3], const float d[3], const float sphere[4], double tnear,
                         double tfar) {
  return sphere_hit<double>({double{o[0]} - sphere[0], double{o[1]} - sphere[1], double{o[2]} - sphere[2]},
                            {d[0], d[1], d[2]}, sphere[3], tnear, tfar);
}

/// Texture coordinates of the unit direction (x, y, z) from a sphere's centre in its object space.
template <class F>
inline void sphere_uv(F x, F y, F z, F* u, F* v) {
  *u = turns(y, x);
  *v = 1.0f - 2.0f * turns(sqrt(x * x + y * y), z);
}

}  // namespace lightmill
