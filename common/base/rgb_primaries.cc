#include "common/base/rgb_primaries.h"

#include <cmath>

namespace lightmill {
namespace {

using Column = std::array<double, 3>;

/// Of what is told apart: primaries nearer to a line than this are on it.
constexpr double kLeastArea = 1e-6;
constexpr double kSame = 1e-3;

/// XYZ to the responses of cones (Lam, "Metamerism and colour constancy", 1985).
constexpr RgbMatrix kBradford{
    {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};

RgbMatrix product(const RgbMatrix& a, const RgbMatrix& b) {
  RgbMatrix out{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) out[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  }
  return out;
}

/// By cofactors. Nothing if it is singular, or not of numbers.
std::optional<RgbMatrix> inverted(const RgbMatrix& m) {
  RgbMatrix out{};
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3, k = (i + 2) % 3;
    for (size_t c = 0; c < 3; ++c) {
      const size_t d = (c + 1) % 3, e = (c + 2) % 3;
      out[c][i] = m[j][d] * m[k][e] - m[j][e] * m[k][d];
    }
  }
  const double determinant = m[0][0] * out[0][0] + m[0][1] * out[1][0] + m[0][2] * out[2][0];
  if (!(std::abs(determinant) > kLeastArea)) return std::nullopt;
  for (Column& row : out) {
    for (double& x : row) x /= determinant;
  }
  return out;
}

/// Of luminance 1.
Column white_xyz(const RgbPrimaries& p) {
  const double x = p.white[0], y = p.white[1];
  return {x / y, 1, (1 - x - y) / y};
}

/// XYZ seen under the white of `from` to what looks the same under that of `to`.
RgbMatrix adaptation(const RgbPrimaries& from, const RgbPrimaries& to) {
  const Column seen = transformed(kBradford, white_xyz(from)), wanted = transformed(kBradford, white_xyz(to));
  RgbMatrix scaled = kBradford;
  for (size_t i = 0; i < 3; ++i) {
    for (double& x : scaled[i]) x *= wanted[i] / seen[i];
  }
  return product(*inverted(kBradford), scaled);
}

}  // namespace

std::array<double, 3> transformed(const RgbMatrix& m, const std::array<double, 3>& v) {
  Column out{};
  for (size_t i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
  return out;
}

std::optional<RgbMatrix> rgb_to_xyz(const RgbPrimaries& p) {
  RgbMatrix m{};
  const RgbPrimaries::Point* const points[] = {&p.red, &p.green, &p.blue};
  for (size_t c = 0; c < 3; ++c) {
    const double x = (*points[c])[0], y = (*points[c])[1];
    m[0][c] = x, m[1][c] = y, m[2][c] = 1 - x - y;
  }
  const auto back = inverted(m);
  if (!back || !(p.white[1] > kLeastArea)) return std::nullopt;
  const Column shares = transformed(*back, white_xyz(p));
  for (const double share : shares) {
    if (!(share > kLeastArea)) return std::nullopt;
  }
  for (Column& row : m) {
    for (size_t c = 0; c < 3; ++c) row[c] *= shares[c];
  }
  return m;
}

std::optional<RgbMatrix> xyz_to_rgb(const RgbPrimaries& space) {
  const auto m = rgb_to_xyz(space);
  return m ? inverted(*m) : std::nullopt;
}

bool are_same(const RgbPrimaries& a, const RgbPrimaries& b) {
  const auto near = [](const RgbPrimaries::Point& p, const RgbPrimaries::Point& q) {
    return std::abs(p[0] - q[0]) <= kSame && std::abs(p[1] - q[1]) <= kSame;
  };
  return near(a.red, b.red) && near(a.green, b.green) && near(a.blue, b.blue) && near(a.white, b.white);
}

std::optional<RgbMatrix> rgb_conversion(const RgbPrimaries& from, const RgbPrimaries& to) {
  const auto in = rgb_to_xyz(from), out = xyz_to_rgb(to);
  if (!in || !out) return std::nullopt;
  return product(*out, product(adaptation(from, to), *in));
}

void convert_color(const RgbMatrix& m, float rgb[3]) {
  const double r = rgb[0], g = rgb[1], b = rgb[2];
  for (size_t i = 0; i < 3; ++i) rgb[i] = static_cast<float>(m[i][0] * r + m[i][1] * g + m[i][2] * b);
}

}  // namespace lightmill
