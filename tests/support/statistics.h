#pragma once
// Statistics for tests: means from independent batches, Student's t, chi^2, Sidak's correction.
//
//   const Estimate e = estimate(batch_means);
//   EXPECT_TRUE(mean_is(e, exact, {.resolution = 0.01}));
#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace lightmill::test {

/// Mean and its standard error from `n` independent values.
struct Estimate {
  double mean = 0, standard_error = 0;
  int n = 0;
};
Estimate estimate(std::span<const double> values);

/// Regularised upper incomplete gamma function Q(a, x): the tail of chi^2 is Q(dof / 2, statistic / 2).
double upper_gamma(double a, double x);
/// Regularised incomplete beta function I_x(a, b).
double incomplete_beta(double a, double b, double x);
/// Probability that |T| >= |t| for Student's t with `dof` degrees of freedom.
double student_two_sided(double t, double dof);
/// t with student_two_sided(t, dof) = p.
double student_quantile(double p, double dof);
/// Level of each of `n` independent tests for a family-wise level `alpha` (Sidak).
double sidak(double alpha, int64_t n);

/// How a mean is compared with an exact value.
struct MeanTest {
  double alpha = 1e-4;       // probability of a false alarm
  double resolution = 0.01;  // the interval's half width must be below this fraction of the value, so that an
                             // error of twice that size certainly fails the test
  double rounding = 2e-5;    // relative float error that is allowed besides the noise
};
/// The exact value lies within the (1 - alpha) interval of Student's t, and the interval is narrow enough.
::testing::AssertionResult mean_is(const Estimate& e, double exact, const MeanTest& test = {});
/// Two independent means are equal within the interval of Welch's t; `resolution` as above, of
/// the larger one.
::testing::AssertionResult means_agree(const Estimate& a, const Estimate& b, const MeanTest& test = {});
/// Two-sided p-value of Welch's t for equal means (1 if both are constant and equal, 0 if
/// constant and unequal).
double welch_p(const Estimate& a, const Estimate& b);

/// Pearson's chi^2 of counts against expectations. Bins expected below `pool_below` are pooled.
struct ChiSquare {
  double statistic = 0;
  int dof = 0;
  double p = 1;
};
ChiSquare chi_square(std::span<const double> observed, std::span<const double> expected,
                     double pool_below = 5);
/// p >= sidak(alpha, family).
::testing::AssertionResult chi_square_passes(const ChiSquare& c, int64_t family = 1, double alpha = 1e-3);

/// Deterministic independent uniforms in [0, 1), 24 bits as the renderer's (PCG-XSH-RR, O'Neill 2014).
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ull + 1) { bits(); }
  uint32_t bits();
  float uniform() { return static_cast<float>(bits() >> 8) * 0x1p-24f; }
  double between(double lo, double hi) { return lo + (hi - lo) * uniform(); }

 private:
  uint64_t state_;
};

}  // namespace lightmill::test
