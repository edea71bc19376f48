#pragma once
// Orthographic camera through the origin of normalised space, in both directions.
//
// Directions are fixed and positions are sampled: the roles of M2 and M8 (mis.h) swap from solid angle to
// area. The density of a hit by the camera is raster area per unit area across the ray, times the cosine at
// the surface, at any distance; a light vertex sees the camera along the one direction, with probability one.
#include "common/scene/description.h"
#include "worker/render/camera/camera_ray.h"

namespace lightmill {

struct OrthographicCamera {
  static constexpr bool kHasLens = false, kParallel = true, kWeighted = false;

  float right[3], down[3], forward[3];  // unit image axes and viewing direction, world orientation
  float x0, y0;                         // image-plane position of raster (0, 0), normalised space
  float per_pixel_x, per_pixel_y;       // size of a pixel there
  float pixel_density;                  // raster area (pixels) per unit area of the image plane

  /// Lengths are scaled by 2^scale_exponent. Throws Error(kBadScene) for a window out of all proportion.
  OrthographicCamera(const CameraDescription& description, int width, int height, int scale_exponent);

  template <class F>
  CameraRay<F> ray(F x, F y, F, F) const {
    return {plane_point<F>(x * per_pixel_x + x0, y * per_pixel_y + y0),
            splat3<F>(forward[0], forward[1], forward[2]), splat<F>(pixel_density)};
  }

  template <class F>
  LensConnection<F> connect(const Vec3<F>& p, F, F) const {
    const F a = p.x * right[0] + p.y * right[1] + p.z * right[2];
    const F b = p.x * down[0] + p.y * down[1] + p.z * down[2];
    LensConnection<F> c;
    c.lens = plane_point(a, b);
    c.direction = splat3<F>(-forward[0], -forward[1], -forward[2]);
    c.x = (a - x0) * (1.0f / per_pixel_x);
    c.y = (b - y0) * (1.0f / per_pixel_y);
    c.density = splat<F>(pixel_density);
    c.seen = MaskOf<F>(p.x * forward[0] + p.y * forward[1] + p.z * forward[2] > 0.0f);
    return c;
  }

  /// A point of the image plane, by its right and down.
  template <class F>
  Vec3<F> plane_point(F a, F b) const {
    return {right[0] * a + down[0] * b, right[1] * a + down[1] * b, right[2] * a + down[2] * b};
  }
};

}  // namespace lightmill
