// The statistics that other tests rest on, against tabulated values.
#include "tests/support/statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lightmill::test {
namespace {

TEST(Statistics, ChiSquareTailMatchesTables) {
  EXPECT_NEAR(upper_gamma(0.5, 3.841458820694124 / 2), 0.05, 1e-10);  // 1 degree of freedom
  EXPECT_NEAR(upper_gamma(5, 18.307038053275146 / 2), 0.05, 1e-10);   // 10
  EXPECT_NEAR(upper_gamma(50, 135.80672317102676 / 2), 0.01, 1e-9);   // 100
}

TEST(Statistics, StudentMatchesTables) {
  EXPECT_NEAR(student_quantile(0.05, 1), 12.706204736, 1e-6);
  EXPECT_NEAR(student_quantile(0.05, 15), 2.131449546, 1e-7);
  EXPECT_NEAR(student_quantile(0.001, 30), 3.645958635, 1e-7);
  EXPECT_NEAR(student_two_sided(2.131449546, 15), 0.05, 1e-9);
}

TEST(Statistics, EstimateOfKnownValues) {
  const double values[] = {1, 2, 3, 4};
  const Estimate e = estimate(values);
  EXPECT_DOUBLE_EQ(e.mean, 2.5);
  EXPECT_NEAR(e.standard_error, std::sqrt(5.0 / 3 / 4), 1e-12);
}

TEST(Statistics, ChiSquareAcceptsUniformAndRejectsSkewed) {
  Random random(1);
  std::vector<double> even(64), skewed(64), expected(64, 1000);
  for (int i = 0; i < 64000; ++i) {
    const double u = random.uniform();
    ++even[static_cast<size_t>(u * 64)];
    ++skewed[static_cast<size_t>(std::pow(u, 1.05) * 64)];
  }
  EXPECT_TRUE(chi_square_passes(chi_square(even, expected)));
  EXPECT_FALSE(chi_square_passes(chi_square(skewed, expected)));
}

TEST(Statistics, CountsWhereNoneAreExpectedFail) {
  const double observed[] = {1000, 1000, 40}, expected[] = {1020, 1020, 0};
  EXPECT_FALSE(chi_square_passes(chi_square(observed, expected)));
}

TEST(Statistics, MeanTestAcceptsTheTruthAndRejectsAFewPercent) {
  Random random(2);
  int rejected = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<double> values(16);
    for (double& v : values) {
      v = 0;
      for (int i = 0; i < 64; ++i) v += random.uniform() / 64;
    }
    const Estimate e = estimate(values);
    if (!mean_is(e, 0.5, {.alpha = 0.05, .resolution = 0.2})) ++rejected;
    EXPECT_FALSE(mean_is(e, 0.4, {.alpha = 1e-4, .resolution = 0.2}));
  }
  EXPECT_GE(rejected, 1);  // 10 expected at alpha = 5 %
  EXPECT_LE(rejected, 25);
}

}  // namespace
}  // namespace lightmill::test
