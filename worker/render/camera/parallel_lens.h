#pragma once
// Orthographic camera with a thin lens, in both directions.
//
// Rays through a raster position leave a uniform point of a lens around its point of the image plane (an
// ellipse in the image axes) for where the position's own ray meets the plane of focus. For one point of
// the lens all rays are parallel: an orthographic camera, sheared.
#include "worker/render/camera/orthographic.h"
#include "worker/render/camera/thin_lens.h"

namespace lightmill {

struct ParallelLensCamera {
  static constexpr bool kHasLens = true, kParallel = true, kWeighted = false;

  OrthographicCamera window;
  LensScale lens;

  /// Lengths are scaled by 2^scale_exponent. Throws Error(kBadScene) for lengths out of all proportion.
  ParallelLensCamera(const CameraDescription& description, int width, int height, int scale_exponent);

  template <class F>
  CameraRay<F> ray(F x, F y, F lens_u, F lens_v) const {
    F a, b, cosine;
    square_to_disk(lens_u, lens_v, &a, &b);
    const Vec3<F> direction = direction_from(a, b, &cosine);
    return {window.plane_point<F>(x * window.per_pixel_x + window.x0 + a * lens.radius_x,
                                  y * window.per_pixel_y + window.y0 + b * lens.radius_y),
            direction, window.pixel_density / cosine};
  }

  template <class F>
  LensConnection<F> connect(const Vec3<F>& p, F lens_u, F lens_v) const {
    F a, b, cosine;
    square_to_disk(lens_u, lens_v, &a, &b);
    const float *r = window.right, *d = window.down, *f = window.forward;
    const F depth = p.x * f[0] + p.y * f[1] + p.z * f[2];
    const F x = p.x * r[0] + p.y * r[1] + p.z * r[2] + a * lens.shear_x * depth;
    const F y = p.x * d[0] + p.y * d[1] + p.z * d[2] + b * lens.shear_y * depth;
    LensConnection<F> c;
    c.lens = window.plane_point<F>(x, y);
    c.direction = -direction_from(a, b, &cosine);
    c.x = (x - a * lens.radius_x - window.x0) * (1.0f / window.per_pixel_x);
    c.y = (y - b * lens.radius_y - window.y0) * (1.0f / window.per_pixel_y);
    c.density = window.pixel_density / cosine;
    c.seen = MaskOf<F>(depth > 0.0f);
    return c;
  }

 private:
  template <class F>
  Vec3<F> direction_from(F a, F b, F* cosine) const {
    const F x = -a * lens.shear_x, y = -b * lens.shear_y;
    *cosine = 1.0f / sqrt(1.0f + x * x + y * y);
    const float *r = window.right, *d = window.down, *f = window.forward;
    return Vec3<F>{x * r[0] + y * d[0] + f[0], x * r[1] + y * d[1] + f[1], x * r[2] + y * d[2] + f[2]} *
           *cosine;
  }
};

}  // namespace lightmill
