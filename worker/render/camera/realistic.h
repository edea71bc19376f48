#pragma once
// Camera of a film behind a system of lenses: pbrt's "realistic".
//
// A pixel's ray starts on the film, goes through a point of the exit pupil's bounds and on through all
// lenses. Its weight makes the mean over film and pupil the irradiance of the film, over the square of the
// rear's distance (Kolb et al. 1995): cos^4 of the ray on the film times the bounds' area over that square.
// Which film points see a point of the scene is not known, so there is no light tracing.
#include "worker/render/camera/camera_ray.h"
#include "worker/render/camera/lens_stack.h"

namespace lightmill {

struct RealisticCamera {
  static constexpr bool kHasLens = true, kParallel = false, kWeighted = true;

  LensStack lenses;
  std::vector<PupilBounds> pupils;
  float right[3], up[3], forward[3];  // world directions of lens space's axes per metre, normalised space
  float half_x, half_y;               // of the film, m
  float per_pixel_x, per_pixel_y;     // m
  float pupils_per_metre, rear_z;

  /// Lengths are scaled by 2^scale_exponent. Throws Error(kBadScene).
  RealisticCamera(const CameraDescription& description, int width, int height, int scale_exponent);

  template <class F>
  CameraRay<F> ray(F x, F y, F lens_u, F lens_v) const {
    // The picture is upside down on the film; y is up, the raster's down.
    const F fx = half_x - x * per_pixel_x, fy = y * per_pixel_y - half_y;
    const F r = sqrt(fx * fx + fy * fy);
    const F last = splat<F>(kPupils - 1);
    const IntOf<F> k = to_int(min(r * pupils_per_metre, last)) * 4;
    const float* table = &pupils.front().x0;
    const F x0 = gather(table, k), x1 = gather(table + 1, k), y0 = gather(table + 2, k),
            y1 = gather(table + 3, k);
    const F px = x0 + (x1 - x0) * lens_u, py = y0 + (y1 - y0) * lens_v;
    const MaskOf<F> apart = MaskOf<F>(r > 0.0f);
    const F inv_r = 1.0f / select(apart, r, splat<F>(1.0f));
    const F c = select(apart, fx * inv_r, splat<F>(1.0f)), s = select(apart, fy * inv_r, F{});
    Vec3<F> o{fx, fy, F{}}, d{c * px - s * py - fx, s * px + c * py - fy, splat<F>(rear_z)};
    const F area = (x1 - x0) * (y1 - y0);
    const F d2 = dot(d, d), cos2 = d.z * d.z / d2;
    CameraRay<F> ray;
    const F through = trace_lenses<F>(lenses, &o, &d, MaskOf<F>(area > 0.0f));
    ray.weight = through * (cos2 * cos2 * area * (1.0f / (rear_z * rear_z)));
    const MaskOf<F> alive = MaskOf<F>(ray.weight > 0.0f);
    ray.origin = select(alive, to_world(o), Vec3<F>{});
    ray.direction = select(alive, normalize(to_world(d)), splat3<F>(0, 0, 1));
    ray.density = splat<F>(1.0f);  // of no strategy
    return ray;
  }

  template <class F>
  LensConnection<F> connect(const Vec3<F>&, F, F) const {
    LensConnection<F> none;
    none.seen = splat_mask<F>(false);
    return none;
  }

 private:
  template <class F>
  Vec3<F> to_world(const Vec3<F>& p) const {
    return {right[0] * p.x + up[0] * p.y + forward[0] * p.z, right[1] * p.x + up[1] * p.y + forward[1] * p.z,
            right[2] * p.x + up[2] * p.y + forward[2] * p.z};
  }
};

}  // namespace lightmill
