#include "common/error/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace lightmill {

namespace {

constexpr double kPi = std::numbers::pi;
// The paper's constants: colour (4.1.3) and feature (4.2) parts.
constexpr float kQc = 0.7f, kPc = 0.4f, kPt = 0.95f, kQf = 0.5f;
constexpr double kFeatureWidth = 0.082;  // w, degrees

using Plane = std::vector<float>;
using Planes = std::array<Plane, 3>;
using Color = std::array<float, 3>;

struct Size {
  int width = 0, height = 0;
  size_t count() const { return static_cast<size_t>(width) * static_cast<size_t>(height); }
};

// Linear Rec.709 <-> XYZ (D65), IEC 61966-2-1; the white point is that of RGB (1, 1, 1).
constexpr Color kWhite = {0.4124f + 0.3576f + 0.1805f, 0.2126f + 0.7152f + 0.0722f,
                          0.0193f + 0.1192f + 0.9505f};

Color to_xyz_relative(const Color& rgb) {
  return {(0.4124f * rgb[0] + 0.3576f * rgb[1] + 0.1805f * rgb[2]) / kWhite[0],
          (0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2]) / kWhite[1],
          (0.0193f * rgb[0] + 0.1192f * rgb[1] + 0.9505f * rgb[2]) / kWhite[2]};
}

/// Inverse of the matrix above by Cramer's rule, once.
std::array<Color, 3> inverse_matrix() {
  constexpr double m[3][3] = {{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}};
  const double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) -
                     m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                     m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  std::array<Color, 3> inverse;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      const size_t r0 = (j + 1) % 3, r1 = (j + 2) % 3, c0 = (i + 1) % 3, c1 = (i + 2) % 3;
      inverse[i][j] = static_cast<float>((m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0]) / det);
    }
  }
  return inverse;
}

/// XYZ relative to white -> linear RGB clamped to the display's gamut.
Color to_rgb_clamped(const Color& relative) {
  static const std::array<Color, 3> kInverse = inverse_matrix();
  Color rgb;
  for (size_t i = 0; i < 3; ++i) {
    float v = 0;
    for (size_t j = 0; j < 3; ++j) v += kInverse[i][j] * relative[j] * kWhite[j];
    rgb[i] = std::clamp(v, 0.0f, 1.0f);
  }
  return rgb;
}

Color to_ycxcz(const Color& rgb) {
  const Color f = to_xyz_relative(rgb);
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

Color from_ycxcz(const Color& c) {
  const float y = (c[0] + 16) / 116;
  return to_rgb_clamped({c[1] / 500 + y, y, y - c[2] / 200});
}

/// CIE L*a*b* with the Hunt effect: chroma counts for less where it is dark (4.1.3).
Color to_hunt_lab(const Color& rgb) {
  constexpr float kDelta = 6.0f / 29;
  Color f = to_xyz_relative(rgb);
  for (float& v : f) v = v > kDelta * kDelta * kDelta ? std::cbrt(v) : v / (3 * kDelta * kDelta) + 4.0f / 29;
  const float l = 116 * f[1] - 16;
  return {l, 0.01f * l * 500 * (f[0] - f[1]), 0.01f * l * 200 * (f[1] - f[2])};
}

/// The HyAB distance: city block in lightness, Euclidean in chroma.
float hyab(const Color& a, const Color& b) {
  return std::fabs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]);
}

/// Convolves with an odd 1D kernel along x, then another along y; the border is replicated.
Plane convolve(const Plane& in, Size size, const std::vector<float>& kernel_x,
               const std::vector<float>& kernel_y) {
  const auto w = static_cast<size_t>(size.width), h = static_cast<size_t>(size.height);
  const size_t rx = kernel_x.size() / 2;
  Plane rows(size.count());
  std::vector<float> padded(w + 2 * rx);
  for (size_t y = 0; y < h; ++y) {
    const float* from = &in[y * w];
    std::fill_n(padded.begin(), rx, from[0]);
    std::copy_n(from, w, padded.begin() + static_cast<std::ptrdiff_t>(rx));
    std::fill_n(padded.end() - static_cast<std::ptrdiff_t>(rx), rx, from[w - 1]);
    float* to = &rows[y * w];
    for (size_t k = 0; k < kernel_x.size(); ++k) {
      for (size_t x = 0; x < w; ++x) to[x] += kernel_x[k] * padded[x + k];
    }
  }
  const auto ry = static_cast<int>(kernel_y.size() / 2);
  Plane out(size.count());
  for (int y = 0; y < size.height; ++y) {
    float* to = &out[static_cast<size_t>(y) * w];
    for (int k = -ry; k <= ry; ++k) {
      const float* from = &rows[static_cast<size_t>(std::clamp(y + k, 0, size.height - 1)) * w];
      const float weight = kernel_y[static_cast<size_t>(k + ry)];
      for (size_t x = 0; x < w; ++x) to[x] += weight * from[x];
    }
  }
  return out;
}

/// One Gaussian of a contrast sensitivity function: a sqrt(pi/b) exp(-pi^2 d^2 / b), d in degrees (4.1.1).
struct CsfGaussian {
  double a = 0, b = 1;
};

/// Filters a channel by a sum of Gaussians, normalized to sum 1.
Plane csf_filter(const Plane& in, Size size, const std::vector<CsfGaussian>& gaussians) {
  // The radius of the widest Gaussian (b = 0.04) for every channel, three standard deviations.
  const int radius =
      static_cast<int>(std::ceil(3 * std::sqrt(0.04 / (2 * kPi * kPi)) * kFlipPixelsPerDegree));
  Plane out(size.count(), 0.0f);
  double total = 0;
  std::vector<double> scale;
  std::vector<std::vector<float>> kernels;
  for (const CsfGaussian& g : gaussians) {
    std::vector<float> kernel;
    double sum = 0;
    for (int i = -radius; i <= radius; ++i) {
      const double d = i / kFlipPixelsPerDegree;
      const double v = std::exp(-kPi * kPi * d * d / g.b);
      kernel.push_back(static_cast<float>(v));
      sum += v;
    }
    scale.push_back(g.a * std::sqrt(kPi / g.b));
    total += scale.back() * sum * sum;
    kernels.push_back(std::move(kernel));
  }
  for (size_t i = 0; i < kernels.size(); ++i) {
    const Plane part = convolve(in, size, kernels[i], kernels[i]);
    const auto weight = static_cast<float>(scale[i] / total);
    for (size_t k = 0; k < out.size(); ++k) out[k] += weight * part[k];
  }
  return out;
}

/// Makes positive and negative weights sum to +1 and -1 each.
void normalize_signed(std::vector<float>* kernel) {
  float positive = 0, negative = 0;
  for (const float v : *kernel) (v > 0 ? positive : negative) += v;
  for (float& v : *kernel) v /= v > 0 ? positive : -negative;
}

/// Edge and point strength of the lightness (4.2): first and second derivatives of a Gaussian.
struct Features {
  Plane edges, points;
};
Features detect_features(const Plane& y, Size size) {
  const double sigma = 0.5 * kFeatureWidth * kFlipPixelsPerDegree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<float> smooth, edge, point;
  float sum = 0;
  for (int i = -radius; i <= radius; ++i) {
    const auto g = static_cast<float>(std::exp(-i * i / (2 * sigma * sigma)));
    smooth.push_back(g);
    sum += g;
    edge.push_back(static_cast<float>(-i) * g);
    point.push_back(static_cast<float>(i * i / (sigma * sigma) - 1) * g);
  }
  for (float& v : smooth) v /= sum;
  normalize_signed(&edge);
  normalize_signed(&point);
  const auto strength = [&](const std::vector<float>& kernel) {
    Plane dx = convolve(y, size, kernel, smooth);
    const Plane dy = convolve(y, size, smooth, kernel);
    for (size_t i = 0; i < dx.size(); ++i) dx[i] = std::hypot(dx[i], dy[i]);
    return dx;
  };
  return {strength(edge), strength(point)};
}

struct Perceived {
  std::vector<Color> lab;  // filtered by the eye, Hunt-adjusted
  Features features;       // of the unfiltered lightness
};

Perceived perceive(const Image& image) {
  const Size size{image.width, image.height};
  Planes c;
  for (Plane& plane : c) plane.resize(size.count());
  for (size_t i = 0; i < size.count(); ++i) {
    Color rgb;
    for (size_t k = 0; k < 3; ++k) rgb[k] = std::clamp(image.data[3 * i + k], 0.0f, 1.0f);
    const Color v = to_ycxcz(rgb);
    for (size_t k = 0; k < 3; ++k) c[k][i] = v[k];
  }
  Plane lightness(size.count());
  for (size_t i = 0; i < lightness.size(); ++i) lightness[i] = (c[0][i] + 16) / 116;
  Perceived p;
  p.features = detect_features(lightness, size);
  c[0] = csf_filter(c[0], size, {{1, 0.0047}});
  c[1] = csf_filter(c[1], size, {{1, 0.0053}});
  c[2] = csf_filter(c[2], size, {{34.1, 0.04}, {13.5, 0.025}});
  p.lab.resize(size.count());
  for (size_t i = 0; i < size.count(); ++i) p.lab[i] = to_hunt_lab(from_ycxcz({c[0][i], c[1][i], c[2][i]}));
  return p;
}

}  // namespace

double flip_mean(const Image& image, const Image& reference) {
  const Perceived a = perceive(image), b = perceive(reference);
  // The largest difference a display can show: pure green to pure blue (4.1.3).
  const float max_difference = std::pow(hyab(to_hunt_lab({0, 1, 0}), to_hunt_lab({0, 0, 1})), kQc);
  const float knee = kPc * max_difference;
  double sum = 0;
  for (size_t i = 0; i < a.lab.size(); ++i) {
    float color = std::pow(hyab(a.lab[i], b.lab[i]), kQc);
    color = color < knee ? kPt / knee * color : kPt + (color - knee) / (max_difference - knee) * (1 - kPt);
    const float edge = std::fabs(a.features.edges[i] - b.features.edges[i]);
    const float point = std::fabs(a.features.points[i] - b.features.points[i]);
    const float feature = std::pow(std::max(edge, point) / std::numbers::sqrt2_v<float>, kQf);
    sum += static_cast<double>(std::pow(color, std::max(0.0f, 1 - feature)));
  }
  return sum / static_cast<double>(a.lab.size());
}

}  // namespace lightmill
