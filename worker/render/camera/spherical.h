#pragma once
// Camera at the origin of normalised space that sees all directions, in both directions; pbrt-v4's mappings.
//
// Equal-area: the square picture of Clarberg's octahedral mapping, one density everywhere. Equirectangular: y
// is the polar angle from up, x the azimuth; the density grows as 1 / sin towards the poles. Or a part of
// that, laid out as Blender's (PanoramaRange). The raster goes on past its edges, where pixel filters reach:
// wrap() says which pixel is meant there.
#include "common/scene/description.h"
#include "worker/render/camera/camera_ray.h"
#include "worker/render/math/equal_area.h"

namespace lightmill {

struct SphericalCamera {
  static constexpr bool kHasLens = false, kParallel = false, kWeighted = false;

  float right[3], up[3], forward[3];  // unit, world orientation
  bool equal_area;
  float width, height;  // of the raster
  float inv_width, inv_height;
  // Of a range: azimuth = s_from + s_step s in turns, polar angle = t_from + t_step t in half turns.
  bool ranged = false;
  float s_from = 0, s_step = 1, t_from = 0, t_step = 1;
  bool round_x = true, round_y = true;  // the raster's edges meet

  SphericalCamera(const CameraDescription& description, int raster_width, int raster_height);

  template <class F>
  CameraRay<F> ray(F x, F y, F, F) const {
    CameraRay<F> r;
    const Vec3<F> w =
        equal_area ? from_equal_area(x * inv_width, y * inv_height)
                   : from_equirectangular(x * inv_width * s_step + s_from, y * inv_height * t_step + t_from);
    r.direction = {right[0] * w.x + up[0] * w.y + forward[0] * w.z,
                   right[1] * w.x + up[1] * w.y + forward[1] * w.z,
                   right[2] * w.x + up[2] * w.y + forward[2] * w.z};
    r.density = pdf_solid_angle(w);
    return r;
  }

  template <class F>
  LensConnection<F> connect(const Vec3<F>& p, F, F) const {
    LensConnection<F> c;
    const F d2 = dot(p, p);
    c.seen = MaskOf<F>(d2 > 0.0f);
    const F inv_d2 = 1.0f / select(c.seen, d2, splat<F>(1.0f));
    c.direction = p * -sqrt(inv_d2);
    const Vec3<F> d = -c.direction;
    const Vec3<F> w{d.x * right[0] + d.y * right[1] + d.z * right[2], d.x * up[0] + d.y * up[1] + d.z * up[2],
                    d.x * forward[0] + d.y * forward[1] + d.z * forward[2]};
    F s, t;
    if (equal_area) {
      equal_area_sphere_to_square<F>({w.x, w.z, w.y}, &s, &t);
    } else {
      const F sine = sqrt(w.x * w.x + w.z * w.z);
      s = turns(w.z, w.x);
      t = 2.0f * turns(sine, w.y);
      if (ranged) {
        // From the middle of the range, the shorter way round.
        F apart = s - (s_from + 0.5f * s_step);
        apart = apart - floor(apart + 0.5f);
        s = 0.5f + apart * (1.0f / s_step);
        t = (t - t_from) * (1.0f / t_step);
      }
    }
    c.x = s * width;
    c.y = t * height;
    c.density = pdf_solid_angle(w) * inv_d2;
    return c;
  }

  /// The pixel, inside the raster, that shows what pixel (*x, *y) of the continued raster
  /// shows. Both mappings continue as a group that maps pixel centres to pixel centres, but for
  /// the poles of an equirectangular raster of odd width, where half a turn is half a pixel
  /// off: there *x may be either neighbour. Of a range, only edges that meet are continued.
  void wrap(int* x, int* y) const;

 private:
  /// Raster area per unit solid angle in direction `w` of the camera's space.
  template <class F>
  F pdf_solid_angle(const Vec3<F>& w) const {
    if (equal_area) return splat<F>(width * height / (4 * kPi));
    const F sine = sqrt(w.x * w.x + w.z * w.z);
    return width * height / ((2 * kPi * kPi) * (s_step * t_step < 0 ? -s_step * t_step : s_step * t_step)) /
           max(sine, splat<F>(1e-6f));
  }
  template <class F>
  static Vec3<F> from_equirectangular(F s, F t) {
    // Past a pole the meridian goes on on the other side: sin changes sign. Whole turns do not matter.
    F sin_theta, cos_theta, sin_phi, cos_phi;
    const F half = t * 0.5f;
    sincos_2pi(half - floor(half), &sin_theta, &cos_theta);
    sincos_2pi(s - floor(s), &sin_phi, &cos_phi);
    return {sin_theta * cos_phi, cos_theta, sin_theta * sin_phi};
  }
  template <class F>
  static Vec3<F> from_equal_area(F s, F t) {
    // Half turns about the middles of the edges.
    for (int i = 0; i < 2; ++i) {
      MaskOf<F> low = MaskOf<F>(s < 0.0f), high = MaskOf<F>(s > 1.0f);
      s = select(low, -s, select(high, 2.0f - s, s));
      t = select(mask_or(low, high), 1.0f - t, t);
      low = MaskOf<F>(t < 0.0f), high = MaskOf<F>(t > 1.0f);
      t = select(low, -t, select(high, 2.0f - t, t));
      s = select(mask_or(low, high), 1.0f - s, s);
    }
    const Vec3<F> w = equal_area_square_to_sphere<F>(clamp(s, 0.0f, 1.0f), clamp(t, 0.0f, 1.0f));
    return {w.x, w.z, w.y};  // pbrt exchanges y and z, too
  }
};

}  // namespace lightmill
