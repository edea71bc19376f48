// Henyey and Greenstein's phase function: its density against the closed distribution of cos theta, its
// sampler against both, and the lanes against the scalar form.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/statistics.h"
#include "worker/render/bsdf/bsdf_dispatch.h"

namespace lightmill::test {
namespace {

constexpr double kMeanCosines[] = {-0.9999, -0.99, -0.5, -1e-4, 0, 1e-7, 0.3, 0.9, 0.99, 0.9999};

BsdfParams<float> params_of(double g) {
  BsdfParams<float> p;
  p.p[0] = static_cast<float>(g);
  return p;
}

constexpr Vec3<float> kAxis{0, 0, 1};

/// A direction seen from the peak of the phase function, which is forwards, at wi = -z, for g >= 0.
struct FromPeak {
  double g;  // |g|
  double h;  // 1 - cosine to the peak, by the sine next to it
  FromPeak(double mean_cosine, const Vec3<float>& wi)
      : g(std::fabs(double{static_cast<float>(mean_cosine)})) {
    const double x = wi.x, y = wi.y, z = mean_cosine < 0 ? -double{wi.z} : double{wi.z};
    h = z < 0 ? (x * x + y * y) / (std::sqrt(x * x + y * y + z * z) - z) : 1 + z;
  }
  double density() const { return (1 - g * g) / (4 * M_PI * std::pow((1 - g) * (1 - g) + 2 * g * h, 1.5)); }
  /// Probability of a smaller cosine.
  double distribution() const {
    if (g < 1e-3) return 0.5 * (2 - h) * (1 - 1.5 * g * h);  // first order in g
    return (1 - g * g) / (2 * g) * (1 / std::sqrt((1 - g) * (1 - g) + 2 * g * h) - 1 / (1 + g));
  }
};

TEST(PhaseFunction, DensityHasItsClosedForm) {
  for (const double g : kMeanCosines) {
    for (const double h : {0.0, 1e-8, 1e-4, 0.01, 0.5, 1.0, 1.7, 2.0}) {
      const double sine = std::sqrt(h * (2 - h));
      const Vec3<float> wi{static_cast<float>(sine), 0, static_cast<float>(h - 1)};
      const double value =
          double{eval_bsdf<float>(kPhaseFunction, true, params_of(g), kAxis, wi, Mode::kRadiance).pdf};
      EXPECT_NEAR(value / FromPeak(g, wi).density(), 1, 1e-5) << "g " << g << " 1 - cos " << h;
    }
  }
}

// Bins of equal probability over cos theta, and even ones over the azimuth; alpha = 1e-3 over all.
TEST(PhaseFunction, DirectionsFollowTheDensity) {
  constexpr int kPolar = 32, kAzimuth = 8, kSamples = 100000;
  for (const double g : kMeanCosines) {
    SCOPED_TRACE(g);
    Random random(7);
    std::vector<double> observed(kPolar * kAzimuth),
        expected(kPolar * kAzimuth, double{kSamples} / (kPolar * kAzimuth));
    double cosine = 0;
    for (int i = 0; i < kSamples; ++i) {
      const float u = random.uniform(), v = random.uniform();
      const BsdfSample<float> s =
          sample_bsdf<float>(kPhaseFunction, true, params_of(g), kAxis, 0.5f, u, v, Mode::kRadiance);
      ASSERT_TRUE(s.valid);
      ASSERT_NEAR(dot(s.wi, s.wi), 1, 1e-6);
      const FromPeak at(g, s.wi);
      ASSERT_NEAR(double{s.pdf} / at.density(), 1, 1e-5);
      cosine -= double{s.wi.z} / kSamples;
      const double p = at.distribution();
      const double a = std::atan2(s.wi.y, s.wi.x) / (2 * M_PI) + 0.5;
      const auto bin = [](double x, int n) {
        return std::min(static_cast<size_t>(std::max(x, 0.0) * n), static_cast<size_t>(n) - 1);
      };
      ++observed[bin(p, kPolar) * kAzimuth + bin(a, kAzimuth)];
    }
    EXPECT_TRUE(chi_square_passes(chi_square(observed, expected), std::size(kMeanCosines)));
    EXPECT_NEAR(cosine, g, 0.012);  // 6 standard errors of an isotropic mean
  }
}

TEST(PhaseFunction, LanesHaveTheBitsOfTheScalarForm) {
  Random random(3);
  for (const double g : kMeanCosines) {
    float u[8], v[8];
    for (int l = 0; l < 8; ++l) u[l] = random.uniform(), v[l] = random.uniform();
    BsdfParams<Float8> wide;
    wide.p[0] = splat<Float8>(static_cast<float>(g));
    const Vec3<Float8> axis = splat3<Float8>(0, 0, 1);
    const BsdfSample<Float8> s =
        sample_bsdf<Float8>(splat_int<Float8>(kPhaseFunction), splat_mask<Float8>(true), wide, axis, Float8{},
                            load<Float8>(u), load<Float8>(v), Mode::kRadiance);
    for (int l = 0; l < 8; ++l) {
      const BsdfSample<float> one =
          sample_bsdf<float>(kPhaseFunction, true, params_of(g), kAxis, 0, u[l], v[l], Mode::kRadiance);
      EXPECT_EQ(lane(s.wi.x, l), one.wi.x);
      EXPECT_EQ(lane(s.wi.y, l), one.wi.y);
      EXPECT_EQ(lane(s.wi.z, l), one.wi.z);
      EXPECT_EQ(lane(s.pdf, l), one.pdf);
    }
  }
}

}  // namespace
}  // namespace lightmill::test
