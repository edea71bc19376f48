#pragma once
// Ray-sphere intersection in double, shared by the acceleration structure's callback and by the surface
// reconstruction, so that both name the same root.
#include <cmath>

#include "worker/render/math/angle.h"

namespace lightmill {

/// Smallest t in (tnear, tfar) at which o + t d meets the sphere, or a negative number. The discriminant is
/// computed from the perpendicular distance, which does not cancel for far-away spheres (Hearn & Baker;
/// Haines et al., "Precision Improvements for Ray/Sphere Intersection", 2019).
inline double sphere_hit(const float o[3], const float d[3], const float sphere[4], double tnear,
                         double tfar) {
  const double fx = double{o[0]} - sphere[0], fy = double{o[1]} - sphere[1], fz = double{o[2]} - sphere[2];
  const double dx = d[0], dy = d[1], dz = d[2], r = sphere[3];
  const double a = dx * dx + dy * dy + dz * dz;
  const double b = -(fx * dx + fy * dy + fz * dz);
  const double s = b / a;
  const double px = fx + s * dx, py = fy + s * dy, pz = fz + s * dz;
  const double discriminant = r * r - (px * px + py * py + pz * pz);
  if (!(discriminant >= 0)) return -1;
  const double c = fx * fx + fy * fy + fz * fz - r * r;
  const double q = b + std::copysign(std::sqrt(a * discriminant), b);
  double t0 = q == 0 ? 0 : c / q, t1 = q / a;
  if (t0 > t1) std::swap(t0, t1);
  if (t0 > tnear && t0 < tfar) return t0;
  if (t1 > tnear && t1 < tfar) return t1;
  return -1;
}

/// Texture coordinates of the unit direction (x, y, z) from a sphere's centre in its object space.
template <class F>
inline void sphere_uv(F x, F y, F z, F* u, F* v) {
  *u = turns(y, x);
  *v = 1.0f - 2.0f * turns(sqrt(x * x + y * y), z);
}

}  // namespace lightmill
