#pragma once
// The values of one animation sampler over time (glTF 2.0, appendix C, "Animation sampler interpolation
// modes").
#include <cstddef>
#include <span>
#include <vector>

namespace lightmill {

struct Keyframes {
  enum class Interpolation { kStep, kLinear, kCubicSpline };

  Interpolation interpolation = Interpolation::kLinear;
  bool rotations = false;     // quaternions (x, y, z, w), which are turned and kept at length 1
  size_t components = 1;      // numbers of a value
  std::vector<double> times;  // seconds, not decreasing; at least one
  /// Per key `components` numbers; of cubic splines three times as many: in-tangent, value, out-tangent.
  std::vector<float> values;

  /// The value at `time`, as `components` numbers. Before the first key it is that of the first, after the
  /// last that of the last.
  void at(double time, double* out) const;

 private:
  std::span<const float> value(size_t key) const;
};

/// The rotation that is `s` of the way from `a` to `b`, the shorter way round. All unit quaternions.
void slerp(const double* a, const double* b, double s, double* out);

}  // namespace lightmill
