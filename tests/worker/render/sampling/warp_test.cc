// chi^2 of the warps of the unit square against their densities, and equal bits in lanes.
#include "worker/render/sampling/warp.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"

namespace lightmill::test {
namespace {

constexpr int kSamples = 100000;
constexpr size_t kBins = 16;

size_t bin(double x) { return std::min(static_cast<size_t>(std::max(x, 0.0) * kBins), kBins - 1); }

/// Tests that (a, b) = measure(u, v) is uniform on the unit square: `measure` maps a warped point back by
/// CDFs that are written down independently.
template <class Measure>
void expect_uniform(Measure&& measure) {
  Random random(4);
  std::vector<double> observed(kBins * kBins), expected(kBins * kBins, double{kSamples} / (kBins * kBins));
  for (int i = 0; i < kSamples; ++i) {
    const float u = random.uniform(), v = random.uniform();
    double a, b;
    measure(u, v, &a, &b);
    ++observed[bin(a) * kBins + bin(b)];
  }
  EXPECT_TRUE(chi_square_passes(chi_square(observed, expected)));
}

double turn(double y, double x) { return std::atan2(y, x) / (2 * M_PI) + 0.5; }

TEST(Warp, DiskIsUniform) {
  expect_uniform([](float u, float v, double* a, double* b) {
    float x, y;
    square_to_disk(u, v, &x, &y);
    *a = double{x} * x + double{y} * y;  // area below r
    *b = turn(y, x);
  });
}

TEST(Warp, CosineHemisphere) {
  expect_uniform([](float u, float v, double* a, double* b) {
    const Vec3<float> w = square_to_cosine_hemisphere(u, v);
    EXPECT_GT(w.z, 0);
    EXPECT_NEAR(dot(w, w), 1, 1e-6f);
    *a = 1 - double{w.z} * w.z;  // int cos below theta
    *b = turn(w.y, w.x);
  });
}

TEST(Warp, SphereIsUniform) {
  expect_uniform([](float u, float v, double* a, double* b) {
    const Vec3<float> w = square_to_sphere(u, v);
    EXPECT_NEAR(dot(w, w), 1, 1e-6f);
    *a = 0.5 + 0.5 * double{w.z};
    *b = turn(w.y, w.x);
  });
}

TEST(Warp, TriangleIsUniform) {
  expect_uniform([](float u, float v, double* a, double* b) {
    float b1, b2;
    square_to_triangle(u, v, &b1, &b2);
    EXPECT_TRUE(b1 >= 0 && b2 >= 0 && b1 + b2 <= 1.000001f);
    const double rest = 1 - double{b1};  // P(b1 < x) = 1 - (1 - x)^2; b2 is uniform on [0, 1 - b1]
    *a = 1 - rest * rest;
    *b = rest > 0 ? b2 / rest : 0.5;
  });
}

TEST(Warp, CornersOfTheSquareAreFine) {
  const float last = 1 - 0x1p-24f;
  for (const float u : {0.0f, 0.5f, last}) {
    for (const float v : {0.0f, 0.5f, last}) {
      const Vec3<float> h = square_to_cosine_hemisphere(u, v), s = square_to_sphere(u, v);
      EXPECT_NEAR(dot(h, h), 1, 1e-6f);
      EXPECT_GT(h.z, 0);
      EXPECT_NEAR(dot(s, s), 1, 1e-6f);
    }
  }
}

TEST(Warp, LanesHaveTheBitsOfScalars) {
  Random random(6);
  for (int round = 0; round < 5000; ++round) {
    Float8 u{}, v{};
    for (int l = 0; l < 8; ++l) u[l] = random.uniform(), v[l] = random.uniform();
    const Vec3<Float8> h = square_to_cosine_hemisphere(u, v), s = square_to_sphere(u, v);
    Float8 b1, b2;
    square_to_triangle(u, v, &b1, &b2);
    for (int l = 0; l < 8; ++l) {
      const Vec3<float> h1 = square_to_cosine_hemisphere(u[l], v[l]), s1 = square_to_sphere(u[l], v[l]);
      float c1, c2;
      square_to_triangle(u[l], v[l], &c1, &c2);
      ASSERT_EQ(float_bits(h.x[l]), float_bits(h1.x));
      ASSERT_EQ(float_bits(h.z[l]), float_bits(h1.z));
      ASSERT_EQ(float_bits(s.y[l]), float_bits(s1.y));
      ASSERT_EQ(float_bits(b1[l]), float_bits(c1));
      ASSERT_EQ(float_bits(b2[l]), float_bits(c2));
    }
  }
}

}  // namespace
}  // namespace lightmill::test
