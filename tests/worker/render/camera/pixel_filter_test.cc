// Pixel filters: samples follow the density, and splats meet the same integral as camera samples.
#include "worker/render/camera/pixel_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <tuple>
#include <vector>

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

std::vector<PixelFilter> pixel_filters() {
  std::vector<PixelFilter> all;
  for (const auto& [kind, x, y] :
       std::vector<std::tuple<FilterKind, double, double>>{{FilterKind::kBox, 0.5, 0.5},
                                                           {FilterKind::kBox, 1.25, 0.5},
                                                           {FilterKind::kTriangle, 1, 1},
                                                           {FilterKind::kTriangle, 0.7, 2},
                                                           {FilterKind::kGaussian, 1.5, 1.5},
                                                           {FilterKind::kGaussian, 4, 3},
                                                           {FilterKind::kMitchell, 2, 2},
                                                           {FilterKind::kSinc, 4, 3}}) {
    FilterDescription d;
    d.kind = kind;
    d.xradius = x;
    d.yradius = y;
    d.sigma = x / 3;
    all.emplace_back(d);
  }
  return all;
}

/// What the pixels receive of a splat at (x, y).
template <class Add>
void give(const PixelFilter& f, float x, float y, float u, Add&& add) {
  FilterReach<float>(f, x, y).each(0, [&](int i, int j, float weight) {
    if (f.is_kept(&weight, &u)) add(i, j, weight);
  });
}

// A light path that lands uniformly on the raster gives every pixel on average what a camera sample gives: 1;
// of a linear image L(x, y) = x the pixel's centre.
TEST(PixelFilter, SplatsAndCameraSamplesEstimateTheSameIntegral) {
  for (const PixelFilter& f : pixel_filters()) {
    Random random(3);
    const double wide = f.x.radius() + 1, high = f.y.radius() + 1;
    std::vector<double> one(32), linear(32);
    for (size_t b = 0; b < one.size(); ++b) {
      const int kSamples = f.is_signed() ? 60000 : 20000;  // signs make noise
      for (int i = 0; i < kSamples; ++i) {
        const double x = random.between(7.5 - wide, 7.5 + wide), y = random.between(5.5 - high, 5.5 + high);
        give(f, static_cast<float>(x), static_cast<float>(y), random.uniform(), [&](int px, int py, float w) {
          if (px != 7 || py != 5) return;
          one[b] += double{w} * 4 * wide * high / kSamples;
          linear[b] += double{w} * x * 4 * wide * high / kSamples;
        });
      }
    }
    EXPECT_TRUE(mean_is(estimate(one), 1, {.resolution = 0.03}));
    EXPECT_TRUE(mean_is(estimate(linear), 7.5, {.resolution = 0.03}));
  }
}

TEST(PixelFilter, KnowsHowNoisySplatsAreAndToHowManyPixelsTheyGo) {
  for (const PixelFilter& f : pixel_filters()) {
    Random random(4);
    constexpr int kSamples = 40000;
    double squares = 0, pixels = 0, all = 0;
    for (int i = 0; i < kSamples; ++i) {
      const float x = random.uniform(), y = random.uniform();
      give(f, x, y, random.uniform(), [&](int, int, float w) {
        squares += double{w} * double{w};
        ++pixels;
      });
      FilterReach<float>(f, x, y).each(0, [&](int, int, float w) { all += std::fabs(w); });
    }
    EXPECT_NEAR(squares * kSamples / (all * all) / f.splat_noise, 1, 0.03);
    EXPECT_NEAR(pixels / kSamples / f.splat_pixels, 1, 0.03);
    EXPECT_LE(f.splat_pixels, 9);
  }
  // A box of one pixel shares nothing; of the gaussian pbrt has by default, and a triangle of radius 1.
  EXPECT_EQ(pixel_filters()[0].splat_noise, 1);
  EXPECT_NEAR(pixel_filters()[4].splat_noise, 0.347, 0.01);
  EXPECT_NEAR(pixel_filters()[2].splat_noise, 4.0 / 9, 0.01);
}

TEST(PixelFilter, ReachEndsAtItsBounds) {
  const PixelFilter f = pixel_filters()[5];
  const PixelRect bounds{2, 3, 5, 9};
  float inside = 0, all = 0;
  FilterReach<float>(f, 2.3f, 8.9f, bounds).each(0, [&](int x, int y, float w) {
    EXPECT_TRUE(x >= 2 && x < 5 && y >= 3 && y < 9) << x << ' ' << y;
    inside += w;
  });
  FilterReach<float>(f, 2.3f, 8.9f).each(0, [&](int x, int y, float w) {
    if (x >= 2 && x < 5 && y >= 3 && y < 9) all += w;
  });
  EXPECT_GT(inside, 0.1f);
  EXPECT_NEAR(inside, all, 1e-6);
  FilterReach<float>(f, 40, 40, bounds).each(0, [](int, int, float) { ADD_FAILURE(); });
}

TEST(PixelFilter, LanesHaveTheBitsOfScalars) {
  Random random(4);
  for (const FilterAxis& f : filters()) {
    for (int round = 0; round < 500; ++round) {
      Float8 u{};
      for (int l = 0; l < 8; ++l) u[l] = random.uniform();
      const Float8 x = f.sample(u);
      for (int l = 0; l < 8; ++l) ASSERT_EQ(float_bits(x[l]), float_bits(f.sample(float{u[l]})));
    }
  }
  const PixelFilter f = pixel_filters()[4];
  const PixelRect bounds{0, 0, 6, 6};
  for (int round = 0; round < 500; ++round) {
    Float8 x{}, y{};
    for (int l = 0; l < 8; ++l)
      x[l] = static_cast<float>(random.between(-3, 9)), y[l] = static_cast<float>(random.between(-3, 9));
    const FilterReach<Float8> lanes(f, x, y, bounds);
    for (int l = 0; l < 8; ++l) {
      std::vector<std::tuple<int, int, uint32_t>> of_lane, alone;
      lanes.each(l, [&](int i, int j, float w) { of_lane.emplace_back(i, j, float_bits(w)); });
      FilterReach<float>(f, float{x[l]}, float{y[l]}, bounds).each(0, [&](int i, int j, float w) {
        alone.emplace_back(i, j, float_bits(w));
      });
      ASSERT_EQ(of_lane, alone);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
