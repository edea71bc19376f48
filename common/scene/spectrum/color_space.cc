#include "common/scene/spectrum/color_space.h"

namespace lightmill {
namespace {

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;  // rows

/// CIE xy of red, green, blue and white.
struct Primaries {
  double xy[4][2];
};

// ITU-R BT.709, BT.2020; SMPTE ST 2065-1; SMPTE EG 432-1 with the white of displays (D65), as pbrt-v4 has it.
constexpr double kD65x = 0.3127, kD65y = 0.3290;
constexpr Primaries kRec709{{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {kD65x, kD65y}}};
constexpr Primaries kRec2020{{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, {kD65x, kD65y}}};
constexpr Primaries kAces{{{0.7347, 0.2653}, {0, 1}, {0.0001, -0.077}, {0.32168, 0.33767}}};
constexpr Primaries kDciP3{{{0.680, 0.320}, {0.265, 0.690}, {0.150, 0.060}, {kD65x, kD65y}}};

const Primaries& primaries(ColorSpace space) {
  switch (space) {
    case ColorSpace::kRec2020:
      return kRec2020;
    case ColorSpace::kAces:
      return kAces;
    case ColorSpace::kDciP3:
      return kDciP3;
    case ColorSpace::kSrgb:
      break;
  }
  return kRec709;
}

Vector times(const Matrix& m, const Vector& v) {
  Vector out{};
  for (size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

/// By cofactors.
Matrix inverse(const Matrix& m) {
  Matrix out{};
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3, k = (i + 2) % 3;
    for (size_t c = 0; c < 3; ++c) {
      const size_t d = (c + 1) % 3, e = (c + 2) % 3;
      out[c][i] = m[j][d] * m[k][e] - m[j][e] * m[k][d];
    }
  }
  const double det = m[0][0] * out[0][0] + m[0][1] * out[1][0] + m[0][2] * out[2][0];
  for (Vector& row : out) {
    for (double& x : row) x /= det;
  }
  return out;
}

Vector xyz_of(const double xy[2]) { return {xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]}; }

/// From the space's linear RGB to XYZ, with (1, 1, 1) of luminance 1.
Matrix to_xyz(const Primaries& p) {
  Matrix m{};
  for (size_t c = 0; c < 3; ++c) {
    const double x = p.xy[c][0], y = p.xy[c][1];
    m[0][c] = x, m[1][c] = y, m[2][c] = 1 - x - y;
  }
  const Vector scale = times(inverse(m), xyz_of(p.xy[3]));
  for (Vector& row : m) {
    for (size_t c = 0; c < 3; ++c) row[c] *= scale[c];
  }
  return m;
}

}  // namespace

const std::vector<std::string_view>& color_space_names() {
  static const std::vector<std::string_view> names{"srgb", "rec2020", "aces2065-1", "dci-p3"};
  return names;
}

std::optional<ColorSpace> color_space_named(std::string_view name) {
  const auto& names = color_space_names();
  for (size_t i = 0; i < names.size(); ++i) {
    if (names[i] == name) return static_cast<ColorSpace>(i);
  }
  return std::nullopt;
}

std::array<double, 3> to_rec709(ColorSpace space, const std::array<double, 3>& color, bool emission) {
  if (space == ColorSpace::kSrgb) return color;
  const Matrix in = to_xyz(primaries(space)), out = inverse(to_xyz(kRec709));
  Vector rgb = times(out, times(in, color));
  if (emission) return rgb;
  // A surface adapts: what is white there is white here, component by component.
  const Vector white = times(out, times(in, {1, 1, 1}));
  for (size_t c = 0; c < 3; ++c) rgb[c] /= white[c];
  return rgb;
}

}  // namespace lightmill
