#include "common/scene/gltf/animation/keyframes.h"

#include <algorithm>
#include <cmath>

namespace lightmill {
namespace {

/// To length 1; a quaternion without length stays as it is.
void normalise(double* q) {
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(n > 1e-15)) return;
  for (int i = 0; i < 4; ++i) q[i] /= n;
}

}  // namespace

void slerp(const double* a, const double* b, double s, double* out) {
  const double d = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
  const double sign = d < 0 ? -1 : 1, angle = std::acos(std::min(std::fabs(d), 1.0)), sine = std::sin(angle);
  // Where both are nearly the same, so is the straight way.
  constexpr double kSmall = 1e-6;
  const double from = sine > kSmall ? std::sin(angle * (1 - s)) / sine : 1 - s,
               to = sign * (sine > kSmall ? std::sin(angle * s) / sine : s);
  for (int i = 0; i < 4; ++i) out[i] = from * a[i] + to * b[i];
  normalise(out);
}

std::span<const float> Keyframes::value(size_t key) const {
  const bool spline = interpolation == Interpolation::kCubicSpline;
  return std::span(values).subspan((spline ? 3 * key + 1 : key) * components, components);
}

void Keyframes::at(double time, double* out) const {
  // The last key that is not later; of several at one time the last.
  const auto after = std::upper_bound(times.begin(), times.end(), time);
  const auto next = static_cast<size_t>(after - times.begin()), key = next == 0 ? 0 : next - 1;
  std::ranges::copy(value(key), out);
  if (rotations) normalise(out);
  if (next == 0 || next == times.size() || interpolation == Interpolation::kStep) return;
  const double span = times[next] - times[key], s = (time - times[key]) / span;
  const std::span<const float> begin = value(key), end = value(next);
  if (interpolation == Interpolation::kLinear && rotations) {
    double from[4], to[4];
    std::copy_n(out, 4, from);
    std::ranges::copy(end, to);
    normalise(to);
    slerp(from, to, s, out);
    return;
  }
  if (interpolation == Interpolation::kLinear) {
    for (size_t i = 0; i < components; ++i) out[i] = (1 - s) * double{begin[i]} + s * double{end[i]};
    return;
  }
  const double s2 = s * s, s3 = s2 * s;
  const float *leaves = begin.data() + components, *arrives = end.data() - components;
  for (size_t i = 0; i < components; ++i) {
    out[i] = (2 * s3 - 3 * s2 + 1) * double{begin[i]} + span * (s3 - 2 * s2 + s) * double{leaves[i]} +
             (3 * s2 - 2 * s3) * double{end[i]} + span * (s3 - s2) * double{arrives[i]};
  }
  if (rotations) normalise(out);
}

}  // namespace lightmill
