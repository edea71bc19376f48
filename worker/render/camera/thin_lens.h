#pragma once
// Perspective camera with a thin lens, in both directions.
//
// Rays leave a uniform point of the lens, an ellipse or a polygon around the origin in the image axes, for
// the point where the pinhole's ray meets the plane of focus. With the lens point at l and that plane at
// distance f, the ray runs along (t - l / f, 1), where t is the pinhole's image-plane position: a shear,
// which leaves the raster's area per solid angle what it is for a pinhole at l.
#include "worker/render/camera/camera_frame.h"
#include "worker/render/camera/perspective.h"
#include "worker/render/sampling/warp.h"

namespace lightmill {

/// A lens in the image axes.
struct LensScale {
  float radius_x, radius_y;  // normalised space
  float shear_x, shear_y;    // radius over focal distance
};
/// The stop in the unit disk: all of it, or a regular polygon.
struct LensStop {
  int corners = 0;     // 0: a disk
  float rotation = 0;  // of the middle of a side, in turns, in [0, 1)
  float apothem = 1, half_side = 0;

  explicit LensStop(const LensBlades& blades);
  template <class F>
  void sample(F u, F v, F* a, F* b) const {
    if (corners == 0) return square_to_disk(u, v, a, b);
    // A triangle from the centre to a side, and a point of it.
    const F side = u * static_cast<float>(corners), number = floor(side);
    const F far = sqrt(side - number), along = far * (2.0f * v - 1.0f) * half_side;
    const F turn = number * (1.0f / static_cast<float>(corners)) + rotation;
    F s, c;
    sincos_2pi(turn - floor(turn), &s, &c);
    const F out = far * apothem;
    *a = out * c - along * s;
    *b = -(out * s + along * c);  // the image axes' second one goes down
  }
};
/// Lengths are scaled by 2^scale_exponent. Throws Error(kBadScene) for lengths out of all proportion.
LensScale lens_scale(const CameraFrame& frame, const CameraDescription& description, int scale_exponent);

struct ThinLensCamera {
  static constexpr bool kHasLens = true, kParallel = false, kWeighted = false;

  PerspectiveCamera pinhole;
  LensScale lens;
  LensStop stop;

  /// Lengths are scaled by 2^scale_exponent. Throws Error(kBadScene) for lengths out of all proportion.
  ThinLensCamera(const CameraDescription& description, int width, int height, int scale_exponent);

  template <class F>
  CameraRay<F> ray(F x, F y, F lens_u, F lens_v) const {
    F a, b, cosine;
    stop.sample(lens_u, lens_v, &a, &b);
    const Vec3<F> d =
        pinhole.direction_at(x * pinhole.tan_per_pixel_x + pinhole.tan_x0 - a * lens.shear_x,
                             y * pinhole.tan_per_pixel_y + pinhole.tan_y0 - b * lens.shear_y, &cosine);
    return {lens_point(a, b), d, pinhole.pdf_solid_angle(cosine)};
  }

  template <class F>
  LensConnection<F> connect(const Vec3<F>& p, F lens_u, F lens_v) const {
    F a, b;
    stop.sample(lens_u, lens_v, &a, &b);
    LensConnection<F> c;
    const Vec3<F> from = lens_point(a, b);
    c = pinhole.connect(p - from, F{}, F{});
    c.lens = from;
    c.x = c.x + a * (lens.shear_x / pinhole.tan_per_pixel_x);
    c.y = c.y + b * (lens.shear_y / pinhole.tan_per_pixel_y);
    return c;
  }

 private:
  template <class F>
  Vec3<F> lens_point(F a, F b) const {
    const float *r = pinhole.right, *d = pinhole.down;
    const F lx = a * lens.radius_x, ly = b * lens.radius_y;
    return {r[0] * lx + d[0] * ly, r[1] * lx + d[1] * ly, r[2] * lx + d[2] * ly};
  }
};

}  // namespace lightmill
