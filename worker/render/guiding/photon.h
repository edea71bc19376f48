#pragma once
// Photons: where light paths arrive that met nothing but mirrors and smooth glass, and how they got there.
#include <array>
#include <cmath>
#include <cstdint>

#include "worker/render/math/vec.h"

namespace lightmill {

/// What a path did at the mirrors and glass between a surface and a light, counted from the surface. Event i
/// passed through if bit i is set, else it was a reflection. At most kMost of them.
class SpecularEvents {
 public:
  static constexpr int kMost = 16;
  /// The events as one integer, which lanes can hold.
  using Code = int32_t;

  /// Puts an event before all others, as light paths meet them in the opposite order.
  void prepend(bool passes) {
    code_ = ((code_ >> kMost) + 1) << kMost | ((code_ & kBits) << 1 | (passes ? 1 : 0));
  }
  int count() const { return code_ >> kMost; }
  Code code() const { return code_; }
  template <class I>
  static I count_of(I code) {
    return code >> kMost;
  }
  /// 1 per lane if event i passes through.
  template <class I>
  static I passes(I code, int i) {
    return (code >> i) & 1;
  }
  bool operator==(const SpecularEvents&) const = default;

 private:
  static constexpr Code kBits = (1 << kMost) - 1;
  Code code_ = 0;
};

struct Photon {
  Vec3<float> p;
  Vec3<float> w;  // unit direction to where it came from
  /// Change of w per step of p, by rows, for light from the same point of the light.
  std::array<float, 9> turn{};
  float power = 0;
  // For walks.
  int32_t light = -1;
  SpecularEvents events;
  Vec3<float> normal = {};              // geometric one of the surface
  Vec3<float> from = {}, emitted = {};  // where and in which unit direction it left the light
};

/// Unit direction from which light comes to `to`, if it came to `p` from `w` and turns there by `turn`. Not
/// farther from w than derivatives mean anything.
inline Vec3<float> followed(const Vec3<float>& p, const Vec3<float>& w, const std::array<float, 9>& turn,
                            const Vec3<float>& to) {
  constexpr float kMost = 0.3f;
  const Vec3<float> step = to - p;
  const auto row = [&](size_t k) { return turn[k] * step.x + turn[k + 1] * step.y + turn[k + 2] * step.z; };
  const Vec3<float> change{row(0), row(3), row(6)};
  const float most = std::sqrt(dot(change, change));
  return normalize(w + change * (most > kMost ? kMost / most : 1.0f));
}

}  // namespace lightmill
