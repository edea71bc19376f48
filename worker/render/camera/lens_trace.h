#pragma once
// Rays through a system of spherical lenses, over a lane type.
//
// Lens space: the film in z = 0, +z towards the scene, metres. Interfaces are numbered from the film. Where a
// ray misses an interface, is stopped by its rim or totally reflected, it is lost.
#include <vector>

#include "worker/render/math/vec.h"

namespace lightmill {

struct LensInterface {
  float z = 0;             // of its vertex
  float radius = 0;        // of curvature, centre at z - radius; 0: the aperture stop
  float rim2 = 0;          // square of the largest distance from the axis
  float inv_aperture = 0;  // 1 / radius of the stop
  float eta_ratio = 1;     // index towards the scene over that towards the film
};

struct LensStack {
  std::vector<LensInterface> interfaces;
  /// What the stop lets through, `side` x `side` from (-1, -1) over (x, y) / its radius; empty: a disk.
  std::vector<float> stop;
  int side = 0;

  float stop_at(float x, float y) const;
};

/// The ray from a point of the film towards a point before it: where it leaves the front, and what of it gets
/// through (0: lost). `d` need not be of unit length on entry; it is on return.
template <class F>
inline F trace_lenses(const LensStack& lenses, Vec3<F>* o, Vec3<F>* d, MaskOf<F> active) {
  F weight = splat<F>(1.0f);
  *d = normalize(*d);
  for (const LensInterface& at : lenses.interfaces) {
    if (at.radius == 0) {
      const F t = (at.z - o->z) / d->z;
      *o = *o + *d * t;
      active = mask_and(active, MaskOf<F>(t >= 0.0f));
      if (lenses.side > 0) {
        float x[8], y[8], through[8];
        store(x, o->x), store(y, o->y);
        for (int l = 0; l < kWidth<F>; ++l)
          through[l] = lenses.stop_at(x[l] * at.inv_aperture, y[l] * at.inv_aperture);
        weight = weight * load<F>(through);
      } else {
        active = mask_and(active, MaskOf<F>(o->x * o->x + o->y * o->y <= at.rim2));
      }
      continue;
    }
    // |o + t d - c|^2 = r^2 from the point nearest to the centre.
    const Vec3<F> from{o->x, o->y, o->z - (at.z - at.radius)};
    const F nearest = -dot(from, *d);
    const Vec3<F> miss = from + *d * nearest;
    const F half2 = at.radius * at.radius - dot(miss, miss);
    const F half = safe_sqrt(half2);
    const F t = at.radius < 0 ? nearest - half : nearest + half;
    active = mask_and(active, mask_and(MaskOf<F>(half2 >= 0.0f), MaskOf<F>(t >= 0.0f)));
    const Vec3<F> hit = from + *d * t;
    *o = *o + *d * t;
    active = mask_and(active, MaskOf<F>(o->x * o->x + o->y * o->y <= at.rim2));
    // The normal on the film's side.
    Vec3<F> n = hit * splat<F>(1.0f / at.radius);
    const F facing = dot(n, *d);
    n = select(MaskOf<F>(facing > 0.0f), -n, n);
    const F cos_i = abs(facing);
    const F eta = splat<F>(at.eta_ratio);
    const F sin2_t = max(1.0f - cos_i * cos_i, F{}) / (eta * eta);
    active = mask_and(active, MaskOf<F>(sin2_t < 1.0f));
    *d = *d * (1.0f / eta) + n * (cos_i / eta - safe_sqrt(1.0f - sin2_t));
    *d = normalize(select(active, *d, splat3<F>(0, 0, 1)));
  }
  return select(active, weight, F{});
}

}  // namespace lightmill
