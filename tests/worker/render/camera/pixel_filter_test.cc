// Pixel filters: samples follow the density, and splats meet the same integral as camera samples.
#include "worker/render/camera/pixel_filter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"

namespace lightmill::test {
namespace {

FilterAxis axis(FilterKind kind, double radius, double sigma = 0) {
  FilterDescription d;
  d.kind = kind;
  d.sigma = sigma;
  return FilterAxis(d, radius);
}

std::vector<FilterAxis> filters() {
  return {axis(FilterKind::kBox, 0.5),           axis(FilterKind::kBox, 1.25),
          axis(FilterKind::kTriangle, 2),        axis(FilterKind::kTriangle, 0.7),
          axis(FilterKind::kGaussian, 1.5, 0.5), axis(FilterKind::kGaussian, 2, 1),
          axis(FilterKind::kGaussian, 5.5, 0.2)};
}
std::vector<FilterAxis> filters_with_negative_lobes() {
  return {axis(FilterKind::kMitchell, 2), axis(FilterKind::kMitchell, 3.1), axis(FilterKind::kSinc, 4)};
}

/// int density over [a, b] by midpoints.
double integral(const FilterAxis& f, double a, double b, int steps) {
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    sum += double{f.density(static_cast<float>(a + (b - a) * (i + 0.5) / steps))} * (b - a) / steps;
  return sum;
}

TEST(PixelFilter, SamplesFollowTheDensity) {
  for (const FilterAxis& f : filters()) {
    constexpr int kBins = 40, kSamples = 200000;
    const double r = f.radius();
    std::vector<double> observed(kBins), expected(kBins);
    double total = 0;
    for (int i = 0; i < kBins; ++i) {
      const double p = integral(f, -r + 2 * r * i / kBins, -r + 2 * r * (i + 1) / kBins, 2000);
      expected[static_cast<size_t>(i)] = p * kSamples;
      total += p;
    }
    EXPECT_NEAR(total, 1, 1e-4);
    Random random(1);
    for (int i = 0; i < kSamples; ++i) {
      const double x = f.sample(random.uniform());
      ASSERT_LE(std::fabs(x), r * 1.000001);
      ++observed[std::min<size_t>(static_cast<size_t>(std::max(0.0, (x + r) / (2 * r) * kBins)), kBins - 1)];
    }
    EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), 6));
  }
}

TEST(PixelFilter, ShapesAreThoseOfTheirFormulas) {
  const FilterAxis gaussian = axis(FilterKind::kGaussian, 1.5, 0.5),
                   triangle = axis(FilterKind::kTriangle, 2);
  const auto g = [](double x) { return std::exp(-x * x / 0.5) - std::exp(-1.5 * 1.5 / 0.5); };
  double norm = 0;
  for (int i = 0; i < 30000; ++i) norm += g(-1.5 + 3 * (i + 0.5) / 30000) * 3 / 30000;
  for (const double x : {0.0, 0.3, -0.8, 1.1}) {
    // The density is that of the table: piecewise constant, near to the formula.
    EXPECT_NEAR(gaussian.density(static_cast<float>(x)), g(x) / norm, 0.02) << x;
    EXPECT_NEAR(triangle.density(static_cast<float>(x)), (2 - std::fabs(x)) / 4, 1e-6) << x;
  }
  EXPECT_EQ(gaussian.density(1.6f), 0);
}

TEST(PixelFilter, SplatWeightIsTheSumOfDensitiesAndPixelsFollowThem) {
  Random random(2);
  for (const FilterAxis& f : filters()) {
    for (const float p : {10.5f, 10.03f, 10.77f, 13.999f}) {
      double sum = 0;
      std::vector<double> expected(24), observed(24);
      for (int j = 0; j < 24; ++j) {
        const double d = f.density(p - (static_cast<float>(j) + 0.5f));
        expected[static_cast<size_t>(j)] = d;
        sum += d;
      }
      constexpr int kSamples = 20000;
      for (double& e : expected) e *= kSamples / sum;
      for (int i = 0; i < kSamples; ++i) {
        float weight;
        const int j = f.choose_pixel(p, random.uniform(), &weight);
        ASSERT_NEAR(weight, sum, 1e-5 * sum);
        ASSERT_TRUE(j >= 0 && j < 24);
        ++observed[static_cast<size_t>(j)];
      }
      EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), 24)) << p;
    }
  }
}

// Weighted samples are the filter's formula: over each of 40 bins, and over all of it 1.
TEST(PixelFilter, NegativeLobesAreInTheWeights) {
  constexpr int kBins = 40, kSamples = 400000;
  for (const bool lanczos : {false, true}) {
    const double r = lanczos ? 4 : 2;
    const FilterAxis f = axis(lanczos ? FilterKind::kSinc : FilterKind::kMitchell, r);
    ASSERT_TRUE(f.is_signed());
    const auto sinc = [](double x) { return x == 0 ? 1 : std::sin(M_PI * x) / (M_PI * x); };
    const auto formula = [&](double x) {
      x = std::fabs(x);
      if (lanczos) return sinc(x) * sinc(x / 3);
      // B = C = 1/3 in Mitchell & Netravali 1988, eq. 8.
      return x < 1 ? (7 * x * x * x - 12 * x * x + 16.0 / 3) / 6
                   : (-7.0 / 3 * x * x * x + 12 * x * x - 20 * x + 32.0 / 3) / 6;
    };
    std::vector<double> expected(kBins), found(kBins);
    double norm = 0, least = 0;
    for (int i = 0; i < kBins * 1000; ++i) {
      const double v = formula(-r + 2 * r * (i + 0.5) / (kBins * 1000)) * 2 * r / (kBins * 1000);
      expected[static_cast<size_t>(i / 1000)] += v;
      norm += v;
      least = std::min(least, v);
    }
    EXPECT_LT(least, 0);
    double sum = 0;
    for (int i = 0; i < kSamples; ++i) {
      const float u = (static_cast<float>(i) + 0.5f) / kSamples;
      const double x = f.sample(u), w = double{f.weight(u)} / kSamples;
      found[std::min<size_t>(static_cast<size_t>(std::max(0.0, (x + r) / (2 * r) * kBins)), kBins - 1)] += w;
      sum += w;
    }
    EXPECT_NEAR(sum, 1, 1e-4);
    for (size_t i = 0; i < kBins; ++i)
      EXPECT_NEAR(found[i], expected[i] / norm, 1.1 / 256) << i;  // a cell of the table
  }
}

// A light path that lands uniformly on the raster gives every pixel on average what a camera sample gives: 1.
TEST(PixelFilter, SplatsAndCameraSamplesEstimateTheSameIntegral) {
  std::vector<FilterAxis> all = filters();
  for (const FilterAxis& f : filters_with_negative_lobes()) all.push_back(f);
  for (const FilterAxis& f : all) {
    // With a linear image L(x) = x, too: the pixel's value is its centre.
    Random random(3);
    std::vector<double> one(32), linear(32);
    for (size_t b = 0; b < one.size(); ++b) {
      const int kSamples = f.is_signed() ? 60000 : 20000;  // signs make noise
      for (int i = 0; i < kSamples; ++i) {
        const double p = random.between(0, 16);
        float weight;
        const int j = f.choose_pixel(static_cast<float>(p), random.uniform(), &weight);
        if (j != 7) continue;
        one[b] += double{weight} * 16 / kSamples;
        linear[b] += weight * p * 16 / kSamples;
      }
    }
    EXPECT_TRUE(mean_is(estimate(one), 1, {.resolution = 0.03}));
    EXPECT_TRUE(mean_is(estimate(linear), 7.5, {.resolution = 0.03}));
  }
}

TEST(PixelFilter, LanesHaveTheBitsOfScalars) {
  Random random(4);
  for (const FilterAxis& f : filters()) {
    for (int round = 0; round < 500; ++round) {
      Float8 u{};
      for (int l = 0; l < 8; ++l) u[l] = random.uniform();
      const Float8 x = f.sample(u);
      for (int l = 0; l < 8; ++l) ASSERT_EQ(float_bits(x[l]), float_bits(f.sample(float{u[l]})));
      Float8 p{}, weights{};
      for (int l = 0; l < 8; ++l) p[l] = static_cast<float>(random.between(-3, 9));
      const Int8 pixels = f.choose_pixel(p, u, &weights);
      for (int l = 0; l < 8; ++l) {
        float weight;
        ASSERT_EQ(pixels[l], f.choose_pixel(float{p[l]}, float{u[l]}, &weight));
        ASSERT_EQ(float_bits(weights[l]), float_bits(weight));
      }
    }
  }
}

}  // namespace
}  // namespace lightmill::test
