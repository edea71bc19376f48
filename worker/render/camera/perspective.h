#pragma once
// Pinhole perspective camera at the origin of normalised space, in both directions.
#include "common/scene/description.h"
#include "worker/render/camera/camera_ray.h"

namespace lightmill {

struct PerspectiveCamera {
  static constexpr bool kHasLens = false, kParallel = false, kWeighted = false;

  float right[3], down[3], forward[3];  // unit image axes and viewing direction, world orientation
  float tan_x0, tan_y0;                 // image-plane position (distance 1) of raster (0, 0)
  float tan_per_pixel_x, tan_per_pixel_y;
  float pixel_density;  // raster area per unit area of the plane at distance 1

  PerspectiveCamera(const CameraDescription& description, int width, int height);

  /// Unit direction through image-plane position (px, py); its cosine to the viewing direction.
  template <class F>
  Vec3<F> direction_at(F px, F py, F* cosine) const {
    const F inv = 1.0f / sqrt(px * px + py * py + 1.0f);
    *cosine = inv;
    const F a = px * inv, b = py * inv;
    return {right[0] * a + down[0] * b + forward[0] * inv, right[1] * a + down[1] * b + forward[1] * inv,
            right[2] * a + down[2] * b + forward[2] * inv};
  }
  /// Unit direction through raster (x, y); its cosine to the viewing direction.
  template <class F>
  Vec3<F> direction(F x, F y, F* cosine) const {
    return direction_at<F>(x * tan_per_pixel_x + tan_x0, y * tan_per_pixel_y + tan_y0, cosine);
  }
  /// Density of `direction` for a uniform raster position, per unit solid angle, times one pixel's area.
  template <class F>
  F pdf_solid_angle(F cosine) const {
    return pixel_density / (cosine * cosine * cosine);
  }
  /// Raster position seen in unit direction `w` (away from the camera); the cosine is <= 0 behind it.
  template <class F>
  void project(const Vec3<F>& w, F* x, F* y, F* cosine) const {
    const F c = w.x * forward[0] + w.y * forward[1] + w.z * forward[2];
    const F inv = 1.0f / select(MaskOf<F>(c > 0.0f), c, splat<F>(1.0f));
    *x = ((w.x * right[0] + w.y * right[1] + w.z * right[2]) * inv - tan_x0) * (1.0f / tan_per_pixel_x);
    *y = ((w.x * down[0] + w.y * down[1] + w.z * down[2]) * inv - tan_y0) * (1.0f / tan_per_pixel_y);
    *cosine = c;
  }

  template <class F>
  CameraRay<F> ray(F x, F y, F, F) const {
    CameraRay<F> r;
    F cosine;
    r.direction = direction(x, y, &cosine);
    r.density = pdf_solid_angle(cosine);
    return r;
  }
  template <class F>
  LensConnection<F> connect(const Vec3<F>& p, F, F) const {
    LensConnection<F> c;
    const F d2 = dot(p, p);
    const MaskOf<F> apart = MaskOf<F>(d2 > 0.0f);
    const F inv_d2 = 1.0f / select(apart, d2, splat<F>(1.0f));
    c.direction = p * -sqrt(inv_d2);
    F cosine;
    project(-c.direction, &c.x, &c.y, &cosine);
    c.seen = mask_and(apart, MaskOf<F>(cosine > 0.0f));
    c.density = pdf_solid_angle(select(c.seen, cosine, splat<F>(1.0f))) * inv_d2;
    return c;
  }
};

}  // namespace lightmill
