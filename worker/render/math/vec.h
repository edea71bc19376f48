#pragma once
// Vectors, colours and frames over a lane type.
#include "worker/render/math/lanes.h"

namespace lightmill {

template <class F>
struct Vec3 {
  F x{}, y{}, z{};
};
template <class F>
inline Vec3<F> operator+(const Vec3<F>& a, const Vec3<F>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class F>
inline Vec3<F> operator-(const Vec3<F>& a, const Vec3<F>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class F>
inline Vec3<F> operator-(const Vec3<F>& a) {
  return {-a.x, -a.y, -a.z};
}
/// Component-wise; the product of two colours.
template <class F>
inline Vec3<F> operator*(const Vec3<F>& a, const Vec3<F>& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
template <class F>
inline Vec3<F> operator*(const Vec3<F>& a, F s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class F>
inline F dot(const Vec3<F>& a, const Vec3<F>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class F>
inline Vec3<F> cross(const Vec3<F>& a, const Vec3<F>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class F>
inline Vec3<F> normalize(const Vec3<F>& v) {
  return v * (splat<F>(1.0f) / sqrt(dot(v, v)));
}
template <class F>
inline Vec3<F> select(MaskOf<F> m, const Vec3<F>& a, const Vec3<F>& b) {
  return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}
template <class F>
inline void set_lane(Vec3<F>* v, int l, const Vec3<float>& value) {
  set_lane(&v->x, l, value.x), set_lane(&v->y, l, value.y), set_lane(&v->z, l, value.z);
}
template <class F>
inline F max_component(const Vec3<F>& v) {
  return max(v.x, max(v.y, v.z));
}
template <class F>
inline Vec3<F> splat3(float x, float y, float z) {
  return {splat<F>(x), splat<F>(y), splat<F>(z)};
}
/// Three floats at base + 3 * i per lane.
template <class F>
inline Vec3<F> gather3(const float* base, IntOf<F> i) {
  F r[3];
  load_triples(base, i * 3, r);
  return {r[0], r[1], r[2]};
}

/// Orthonormal frame around a unit normal n (Duff et al., "Building an Orthonormal Basis, Revisited", 2017).
template <class F>
struct Frame {
  Vec3<F> s, t, n;
  explicit Frame(const Vec3<F>& normal) : n(normal) {
    const F sign = copysign(splat<F>(1.0f), n.z);
    const F a = splat<F>(-1.0f) / (sign + n.z);
    const F b = n.x * n.y * a;
    s = {splat<F>(1.0f) + sign * n.x * n.x * a, sign * b, -sign * n.x};
    t = {b, sign + n.y * n.y * a, -n.y};
  }
  Vec3<F> to_local(const Vec3<F>& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  Vec3<F> to_world(const Vec3<F>& v) const { return s * v.x + t * v.y + n * v.z; }
};

}  // namespace lightmill
