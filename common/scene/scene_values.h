#pragma once
// What scene descriptions are made of: points, colours, transforms, places in files. Colours are linear
// Rec.709 (sRGB primaries).
#include <array>
#include <string>

namespace lightmill {

struct Vec2f {
  float x = 0, y = 0;
};
struct Vec3f {
  float x = 0, y = 0, z = 0;
};
struct Vec3d {
  double x = 0, y = 0, z = 0;
};
struct Rgb {
  float r = 0, g = 0, b = 0;
  bool operator==(const Rgb&) const = default;
};
inline bool is_black(const Rgb& c) { return !(c.r > 0 || c.g > 0 || c.b > 0); }

/// How texels make a value: a blend of four, the nearest, or a uniform cubic B-spline of sixteen, which is
/// smoother than they are.
enum class TexelFilter { kBilinear, kNearest, kCubic };

/// Row-major 4x4 matrix acting on column vectors: p' = M p.
struct Transform {
  std::array<std::array<double, 4>, 4> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
};

/// file:line:column of a directive; column and line count from 1.
struct SourceLocation {
  std::string file;
  int line = 0, column = 0;
};

}  // namespace lightmill
