#include "worker/render/bsdf/tables/sheen_table.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "worker/render/bsdf/sheen.h"

namespace lightmill {
namespace {

constexpr int kSide = 64;  // samples of a node: a square of midpoints

/// Cosine of a ring of directions, denser towards grazing ones: x^2.
float ring_cosine(int i) {
  const float x = (static_cast<float>(i) + 0.5f) / kSide;
  return x * x;
}

using Rings = std::array<double, kSide>;

/// D V summed over each ring of wi, for a wo of `cosine`.
Rings ring_sums(const Charlie<float>& sheen, float cosine) {
  const Vec3<float> wo{std::sqrt(1 - cosine * cosine), 0, cosine};
  Rings rings{};
  for (int i = 0; i < kSide; ++i) {
    const float ci = ring_cosine(i), si = std::sqrt(1 - ci * ci);
    for (int j = 0; j < kSide; ++j) {
      float s, c;
      sincos_2pi((static_cast<float>(j) + 0.5f) / (2 * kSide), &s, &c);  // half of the circle: symmetric
      const Vec3<float> wi{si * c, si * s, ci};
      rings[static_cast<size_t>(i)] += double{sheen.value(normalize(wo + wi), cosine, ci)};
    }
  }
  return rings;
}

/// int weight(cos wi) D V cos dwi.
template <class Weight>
double integral(const Rings& rings, const Weight& weight) {
  double sum = 0;
  for (int i = 0; i < kSide; ++i) {
    const float x = (static_cast<float>(i) + 0.5f) / kSide, ci = ring_cosine(i);
    sum += rings[static_cast<size_t>(i)] * double{ci} * weight(ci) * 2 * double{x};
  }
  return sum * 2 * M_PI / (kSide * kSide);
}

}  // namespace

const std::vector<float>& sheen_table() {
  static const std::vector<float> table = [] {
    std::vector<float> t;
    for (int row = 0; row < kSheenRows; ++row) {
      const Charlie<float> sheen(static_cast<float>(row) / (kSheenRows - 1));
      std::array<Rings, kCosineNodes> rings;
      CosineRow raw;
      for (size_t n = 0; n < kCosineNodes; ++n) {
        rings[n] = ring_sums(sheen, node_cosine(static_cast<int>(n)));
        raw[n] = static_cast<float>(integral(rings[n], [](float) { return 1.0; }));
      }
      for (size_t n = 0; n < kCosineNodes; ++n) {
        const float own = raw[n];
        const double albedo = integral(rings[n], [&](float ci) {
          return 1 / std::max({1.0, double{own}, double{CosinePlace<float>(ci).in(raw.data(), 0)}});
        });
        t.push_back(own);
        t.push_back(static_cast<float>(albedo));
      }
    }
    return t;
  }();
  return table;
}

}  // namespace lightmill
