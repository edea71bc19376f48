#pragma once
// A camera that moves, as one at rest whose rays are taken along: at time t in [0, 1] everything that the
// camera at rest (that of time 0) says of a point p holds at point(p, t). The way is a turn about an axis
// through the camera and a shift, which keep lengths and angles, and so all densities.
#include "common/scene/description.h"
#include "worker/render/math/trig.h"
#include "worker/render/math/vec.h"

namespace lightmill {

struct CameraMotion {
  bool moves = false;
  float axis[3] = {1, 0, 0};   // unit
  float turns = 0;             // about it, in all, in [0, 1/2]
  float shift[3] = {0, 0, 0};  // in all, normalised space

  /// Vectors and points of normalised space, seen by the camera at rest, as they are at time `t`.
  template <class F>
  Vec3<F> vector(const Vec3<F>& v, F t) const {
    return turned(v, t, 1.0f);
  }
  template <class F>
  Vec3<F> point(const Vec3<F>& p, F t) const {
    return turned(p, t, 1.0f) + Vec3<F>{t * shift[0], t * shift[1], t * shift[2]};
  }
  /// Where the camera at rest sees what is at `p` at time `t`.
  template <class F>
  Vec3<F> at_rest(const Vec3<F>& p, F t) const {
    return turned(p - Vec3<F>{t * shift[0], t * shift[1], t * shift[2]}, t, -1.0f);
  }

 private:
  /// By Rodrigues' formula.
  template <class F>
  Vec3<F> turned(const Vec3<F>& v, F t, float sign) const {
    F sine, cosine;
    sincos_2pi(t * turns, &sine, &cosine);
    const Vec3<F> a = splat3<F>(axis[0], axis[1], axis[2]);
    return v * cosine + cross(a, v) * (sine * sign) + a * (dot(a, v) * (1.0f - cosine));
  }
};

/// Of the camera of `scene`, whose lengths are scaled by 2^scale_exponent.
CameraMotion camera_motion_of(const SceneDescription& scene, int scale_exponent);

}  // namespace lightmill
