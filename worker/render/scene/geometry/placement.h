#pragma once
// Where an instance puts its object: takes rays into the object's space, and hits back out.
//
// An object is built once, in a space of its own: its box is centred and scaled by a power of two to a size
// of about 1. An instance's matrix A (object space to normalised space) and its inverse W are also kept
// scaled by powers of two to a size of about 1. So objects of any size in scenes of any size meet the same
// numbers. A ray keeps its parameter up to the exact factor time_scale. The ray tracing callbacks and the
// surface reconstruction share this arithmetic, so the bound of its rounding in `error` holds for both.
#include "worker/render/math/ray_offset.h"
#include "worker/render/scene/geometry/instance_pose.h"
#include "worker/render/scene/render_scene.h"

namespace lightmill {

/// For primitives that lie in normalised space themselves: does nothing.
template <class F>
struct NoPlacement {
  const Vec3<F>& origin(const Vec3<F>& o) const { return o; }
  const Vec3<F>& direction(const Vec3<F>& d) const { return d; }
  const Vec3<F>& point(const Vec3<F>& p) const { return p; }
  const Vec3<F>& scaled_vector(const Vec3<F>& v) const { return v; }
  const Vec3<F>& vector(const Vec3<F>& v) const { return v; }
  const Vec3<F>& normal(const Vec3<F>& n) const { return n; }
  Vec3<F> handed(const Vec3<F>& n) const { return n; }
  F error(const Vec3<F>& e, float factor, const Vec3<F>&) const { return max_component(e) * factor; }
};

/// For instances, per lane. Lanes with instance -1 are left as they are, to the bit.
template <class F>
struct Placement {
  MaskOf<F> placed;
  Vec3<F> a[3], w[3];  // rows of A / scale and of W scale
  Vec3<F> position;    // of the object's origin
  F time_scale{};      // ray parameters in object space over those in normalised space
  F spread{};          // max row sum of |A||W|
  F handedness{};      // sign of det A

  /// The placement at `time` in [0, 1], for instances that move.
  static Placement at(const RenderScene& scene, IntOf<F> instance, F time) {
    const MaskOf<F> moving = MaskOf<F>(instance >= scene.first_moving);
    if (any(moving)) return of_table(instance, {scene, instance, time, mask_bits(moving)});
    const IntOf<F> i = select(MaskOf<F>(instance >= 0), instance, IntOf<F>{}) * kInstanceFloats;
    return Placement(instance, [&](int slot) { return gather(scene.instance_records.data() + slot, i); });
  }
  /// The same instance in all lanes. If it moves, only `lanes` have a meaning.
  static Placement of(const RenderScene& scene, int32_t instance, F time, unsigned lanes) {
    if (instance >= scene.first_moving)
      return of_table(splat_int<F>(instance), {scene, splat_int<F>(instance), time, lanes});
    const float* r = scene.instance_records.data() + static_cast<size_t>(instance) * kInstanceFloats;
    return Placement(splat_int<F>(instance), [&](int slot) { return splat<F>(r[slot]); });
  }

  Vec3<F> origin(const Vec3<F>& o) const { return select(placed, apply(w, o - position) * time_scale, o); }
  Vec3<F> direction(const Vec3<F>& d) const { return select(placed, apply(w, d), d); }
  Vec3<F> point(const Vec3<F>& p) const { return select(placed, true_vector(p) + position, p); }
  /// A v over the scale: safe to square.
  Vec3<F> scaled_vector(const Vec3<F>& v) const { return select(placed, apply(a, v), v); }
  Vec3<F> vector(const Vec3<F>& v) const { return select(placed, true_vector(v), v); }
  /// Unit normals transform by the inverse transpose. No normal (0, 0, 0) stays none.
  Vec3<F> normal(const Vec3<F>& n) const {
    const Vec3<F> t = w[0] * n.x + w[1] * n.y + w[2] * n.z;
    const F t2 = dot(t, t);
    const MaskOf<F> some = MaskOf<F>(t2 > 0.0f);
    return select(mask_and(placed, some), t * (1.0f / sqrt(select(some, t2, splat<F>(1.0f)))), n);
  }
  /// A cross product of placed vectors, with the orientation that it had before.
  Vec3<F> handed(const Vec3<F>& n) const { return n * select(placed, handedness, splat<F>(1.0f)); }
  /// Bound of the error of point(p), as seen from a ray there. `e factor`: the bound for p, by axes, since an
  /// axis in which the object is flat may be stretched at will. To it come the rounding of the ray on its way
  /// in (five operations, over |A||W|) and of the point on its way out (three, and the sum).
  F error(const Vec3<F>& e, float factor, const Vec3<F>& p) const {
    const auto size = [](const Vec3<F>& x) { return Vec3<F>{abs(x.x), abs(x.y), abs(x.z)}; };
    const Vec3<F> v = true_vector(p), q = v + position;
    const Vec3<F> moved{dot(size(a[0]), e), dot(size(a[1]), e), dot(size(a[2]), e)};
    const F sum = max_component(moved) * (factor / time_scale) +
                  spread * max_component(size(v)) * gamma_bound(12) + max_component(size(q)) * gamma_bound(3);
    return select(placed, sum, max_component(e) * factor);
  }

 private:
  static Placement of_table(IntOf<F> instance, const RecordTable<F>& table) {
    return Placement(instance, [&](int slot) { return load<F>(table.f[slot]); });
  }
  template <class Slot>
  Placement(IntOf<F> instance, const Slot& slot) : placed(MaskOf<F>(instance >= 0)) {
    for (int i = 0; i < 3; ++i) {
      a[i] = {slot(kInstanceA + 3 * i), slot(kInstanceA + 3 * i + 1), slot(kInstanceA + 3 * i + 2)};
      w[i] = {slot(kInstanceW + 3 * i), slot(kInstanceW + 3 * i + 1), slot(kInstanceW + 3 * i + 2)};
    }
    position = {slot(kInstancePosition), slot(kInstancePosition + 1), slot(kInstancePosition + 2)};
    time_scale = slot(kInstanceTimeScale);
    spread = slot(kInstanceSpread);
    handedness = slot(kInstanceHandedness);
  }
  static Vec3<F> apply(const Vec3<F> (&m)[3], const Vec3<F>& v) {
    return {dot(m[0], v), dot(m[1], v), dot(m[2], v)};
  }
  Vec3<F> true_vector(const Vec3<F>& v) const { return apply(a, v) * (1.0f / time_scale); }
};

}  // namespace lightmill
