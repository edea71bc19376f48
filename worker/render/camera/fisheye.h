#pragma once
// Fisheye cameras at the origin of normalised space, in both directions: Blender's equidistant and equisolid
// lenses, lenses by a polynomial, and its mirror ball.
//
// The angle a to the viewing direction depends on the distance q from the middle of the picture alone, where
// x and y may be stretched: a = q * half field of view, sin(a / 2) = q, or a polynomial of q. Beyond the
// field of view there is nothing: no rays.
#include <algorithm>

#include "common/scene/description.h"
#include "worker/render/camera/camera_ray.h"
#include "worker/render/math/angle.h"
#include "worker/render/math/trig.h"

namespace lightmill {

struct FisheyeCamera {
  static constexpr bool kHasLens = false, kParallel = false, kWeighted = true;

  float right[3], down[3], forward[3];  // unit, world orientation
  bool by_sine;                         // sin(a / 2) = q
  bool polynomial;                      // a by powers of q, in mm
  float turns_by_power[5], first_turn = 0, last_turn = 0;
  static constexpr int kRadii = 256;
  float radii[kRadii + 1];        // q at even turns from 0 to the last: where its search begins
  float half_fov_turns;           // equidistant: a at q = 1, in turns
  float largest;                  // q at the edge of the field of view
  float half_width, half_height;  // of the raster, pixels
  float reach_x, reach_y;         // q at the middles of its edges

  FisheyeCamera(const CameraDescription& description, int raster_width, int raster_height);

  template <class F>
  CameraRay<F> ray(F x, F y, F, F) const {
    const F a = (x * (1.0f / half_width) - 1.0f) * reach_x, b = (y * (1.0f / half_height) - 1.0f) * reach_y;
    const F q = sqrt(a * a + b * b);
    const MaskOf<F> seen = MaskOf<F>(q <= largest), off = MaskOf<F>(q > 0.0f);
    const F inv = 1.0f / select(off, q, splat<F>(1.0f));
    const F within = min(q, splat<F>(largest));
    F sine, cosine;
    if (by_sine) {
      cosine = 1.0f - 2.0f * within * within;
      sine = 2.0f * within * safe_sqrt(1.0f - within * within);
    } else {
      sincos_2pi(polynomial ? turns_at(within) : within * half_fov_turns, &sine, &cosine);
    }
    CameraRay<F> r;
    const F right_of = a * inv * sine, below = b * inv * sine;
    r.direction = {right[0] * right_of + down[0] * below + forward[0] * cosine,
                   right[1] * right_of + down[1] * below + forward[1] * cosine,
                   right[2] * right_of + down[2] * below + forward[2] * cosine};
    r.density = polynomial ? density_at(within, sine) : density(within * (half_fov_turns * 2 * kPi), sine);
    r.weight = select(seen, splat<F>(1.0f), F{});
    return r;
  }

  template <class F>
  LensConnection<F> connect(const Vec3<F>& p, F, F) const {
    LensConnection<F> c;
    const F d2 = dot(p, p);
    const MaskOf<F> apart = MaskOf<F>(d2 > 0.0f);
    const F inv_d2 = 1.0f / select(apart, d2, splat<F>(1.0f));
    c.direction = p * -sqrt(inv_d2);
    const Vec3<F> d = -c.direction;
    const F x = d.x * right[0] + d.y * right[1] + d.z * right[2],
            y = d.x * down[0] + d.y * down[1] + d.z * down[2],
            z = d.x * forward[0] + d.y * forward[1] + d.z * forward[2];
    const F sine = sqrt(x * x + y * y);
    const F turn = turns(sine, z);
    // sin(a / 2) without the cancellation of 1 - z ahead.
    const F half = sqrt(0.5f * select(MaskOf<F>(z > 0.0f), sine * sine / (1.0f + abs(z)), 1.0f - z));
    const F q = by_sine ? half : polynomial ? radius_at(turn) : turn * (1.0f / half_fov_turns);
    const F inv = q / select(MaskOf<F>(sine > 0.0f), sine, splat<F>(1.0f));
    c.x = (x * inv * (1.0f / reach_x) + 1.0f) * half_width;
    c.y = (y * inv * (1.0f / reach_y) + 1.0f) * half_height;
    c.density = (polynomial ? density_at(q, sine) : density(turn * (2 * kPi), sine)) * inv_d2;
    const MaskOf<F> inside = polynomial
                                 ? mask_and(MaskOf<F>(turn >= first_turn), MaskOf<F>(turn <= last_turn))
                                 : MaskOf<F>(q <= largest);
    c.seen = mask_and(apart, inside);
    return c;
  }

 private:
  void set_polynomial(const FisheyeLens& lens);

  template <class F>
  F turns_at(F q) const {
    const float* t = turns_by_power;
    return t[0] + q * (t[1] + q * (t[2] + q * (t[3] + q * t[4])));
  }
  template <class F>
  F slope_at(F q) const {
    const float* t = turns_by_power;
    return t[1] + q * (2.0f * t[2] + q * (3.0f * t[3] + q * (4.0f * t[4])));
  }
  /// The q of an angle, by its table and Newton's method.
  template <class F>
  F radius_at(F turn) const {
    const F at =
        clamp(turn / std::max(last_turn, 1e-12f), 0.0f, 1.0f - 0x1p-20f) * static_cast<float>(kRadii);
    const IntOf<F> i = to_int(at);
    const F begin = gather(&radii[0], i), end = gather(&radii[1], i);
    F q = begin + (end - begin) * (at - to_float(i));
    for (int step = 0; step < 2; ++step)
      q = clamp(q - (turns_at(q) - turn) / max(slope_at(q), splat<F>(1e-9f)), 0.0f, largest);
    return q;
  }
  /// Raster area per unit solid angle, of a polynomial: of q dq over sin(a) da.
  template <class F>
  F density_at(F q, F sine) const {
    const float scale = half_width * half_height / (reach_x * reach_y);
    const F slope = max(slope_at(q), splat<F>(1e-9f)) * (2 * kPi);
    const F ratio = select(MaskOf<F>(abs(sine) > 1e-6f), q / max(abs(sine), splat<F>(1e-6f)), 1.0f / slope);
    return ratio * scale / slope;
  }

  /// Raster area per unit solid angle at angle a and its sine: of q dq over sin(a) da.
  template <class F>
  F density(F angle, F sine) const {
    const float scale = half_width * half_height / (reach_x * reach_y);
    if (by_sine) return splat<F>(0.25f * scale);
    const float half_fov = half_fov_turns * 2 * kPi;
    const F ratio = select(MaskOf<F>(sine > 1e-6f), angle / max(sine, splat<F>(1e-6f)), splat<F>(1.0f));
    return ratio * (scale / (half_fov * half_fov));
  }
};

}  // namespace lightmill
