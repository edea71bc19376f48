#pragma once
// Emitters that lie exactly on another one, as in scenes that list a shape twice.
//
// Rays meet only one of them, while a sampled point may be on either. So the strategies of light transport
// would not agree. The first one is the light, as it is for a ray.
#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>
#include <unordered_map>

namespace lightmill {

class EmitterCopies {
 public:
  /// Sides of a triangle that shine: that of its winding, the other one, or both.
  enum Sides : unsigned { kFront = 1, kBack = 2 };

  /// Notes the triangle of these three points. Returns true if one is there already that shines from all of
  /// `sides`.
  bool triangle(std::array<std::array<float, 3>, 3> p, unsigned sides) {
    // The order of the points names a winding; an odd number of exchanges reverses it.
    const auto order = [&](size_t a, size_t b) {
      if (p[b] < p[a]) {
        std::swap(p[a], p[b]);
        if (sides == kFront || sides == kBack) sides ^= kFront | kBack;
      }
    };
    order(0, 1);
    order(1, 2);
    order(0, 1);
    Key key;
    for (size_t i = 0; i < 3; ++i) std::copy(p[i].begin(), p[i].end(), key.begin() + 3 * i);
    return note(key, sides);
  }
  bool sphere(const float* center_and_radius, bool outwards) {
    Key key;
    key.fill(-1);
    std::copy_n(center_and_radius, 4, key.begin());
    return note(key, outwards ? kFront : kBack);
  }

 private:
  using Key = std::array<float, 9>;
  struct Hash {
    size_t operator()(const Key& key) const {
      char bytes[sizeof key];
      std::memcpy(bytes, key.data(), sizeof bytes);
      return std::hash<std::string_view>()({bytes, sizeof bytes});
    }
  };
  bool note(Key key, unsigned sides) {
    for (float& x : key) x += 0.0f;  // -0 is 0
    unsigned& lit = lit_[key];
    if ((lit & sides) == sides) return true;
    lit |= sides;
    return false;
  }

  std::unordered_map<Key, unsigned, Hash> lit_;
};

}  // namespace lightmill
