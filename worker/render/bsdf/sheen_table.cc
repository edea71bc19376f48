#include "worker/render/bsdf/sheen_table.h"

#include <algorithm>
#include <cmath>

#include "worker/render/bsdf/sheen.h"

namespace lightmill {
namespace {

constexpr int kSide = 64;  // samples of a node: a square of midpoints

/// int divisor(cos wi) D V cos dwi, denser towards grazing wi: cos = x^2.
template <class Weight>
double integral(const Charlie<float>& sheen, float cosine, const Weight& weight) {
  const Vec3<float> wo{std::sqrt(1 - cosine * cosine), 0, cosine};
  double sum = 0;
  for (int i = 0; i < kSide; ++i) {
    const float x = (static_cast<float>(i) + 0.5f) / kSide, ci = x * x, si = std::sqrt(1 - ci * ci);
    double ring = 0;
    for (int j = 0; j < kSide; ++j) {
      float s, c;
      sincos_2pi((static_cast<float>(j) + 0.5f) / (2 * kSide), &s, &c);  // half of the circle: symmetric
      const Vec3<float> wi{si * c, si * s, ci};
      ring += double{sheen.value(normalize(wo + wi), cosine, ci)};
    }
    sum += ring * double{ci} * weight(ci) * 2 * double{x};
  }
  return sum * 2 * M_PI / (kSide * kSide);
}

}  // namespace

const std::vector<float>& sheen_table() {
  static const std::vector<float> table = [] {
    std::vector<float> t;
    for (int row = 0; row < kSheenRows; ++row) {
      const Charlie<float> sheen(static_cast<float>(row) / (kSheenRows - 1));
      CosineRow raw;
      for (int n = 0; n < kCosineNodes; ++n) {
        raw[static_cast<size_t>(n)] =
            static_cast<float>(integral(sheen, node_cosine(n), [](float) { return 1.0; }));
      }
      for (int n = 0; n < kCosineNodes; ++n) {
        const float own = raw[static_cast<size_t>(n)];
        const double albedo = integral(sheen, node_cosine(n), [&](float ci) {
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
