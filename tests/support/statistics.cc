#include "tests/support/statistics.h"

#include <bit>
#include <cmath>

namespace lightmill::test {

Estimate estimate(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  Estimate e;
  e.n = static_cast<int>(values.size());
  for (double v : values) e.mean += v / n;
  double sum = 0;
  for (double v : values) sum += (v - e.mean) * (v - e.mean);
  e.standard_error = e.n > 1 ? std::sqrt(sum / (n - 1) / n) : 0;
  return e;
}

// Series below a + 1, Lentz's continued fraction above (Abramowitz & Stegun 6.5.29, 6.5.31).
double upper_gamma(double a, double x) {
  if (!(x > 0)) return 1;
  const double front = std::exp(-x + a * std::log(x) - std::lgamma(a));
  if (x < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 10000 && std::fabs(term) > 1e-16 * std::fabs(sum); ++n) sum += term *= x / (a + n);
    return 1 - front * sum;
  }
  double b = x + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int n = 1; n < 10000; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    const double delta = d * c;
    h *= delta;
    if (std::fabs(delta - 1) < 1e-15) break;
  }
  return front * h;
}

// Continued fraction of Abramowitz & Stegun 26.5.8 by Lentz's method.
double incomplete_beta(double a, double b, double x) {
  if (!(x > 0)) return 0;
  if (!(x < 1)) return 1;
  if (x > (a + 1) / (a + b + 2)) return 1 - incomplete_beta(b, a, 1 - x);
  const double front =
      std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x)) /
      a;
  double c = 1, d = 1 / (1 - (a + b) * x / (a + 1)), h = d;
  for (int m = 1; m < 10000; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
    d = 1 / (1 + even * d);
    c = 1 + even / c;
    h *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
    d = 1 / (1 + odd * d);
    c = 1 + odd / c;
    h *= d * c;
    if (std::fabs(d * c - 1) < 1e-15) break;
  }
  return front * h;
}

double student_two_sided(double t, double dof) { return incomplete_beta(dof / 2, 0.5, dof / (dof + t * t)); }

double student_quantile(double p, double dof) {
  double lo = 0, hi = 1;
  while (student_two_sided(hi, dof) > p && hi < 1e12) hi *= 2;
  for (int i = 0; i < 200; ++i) {
    const double mid = 0.5 * (lo + hi);
    (student_two_sided(mid, dof) > p ? lo : hi) = mid;
  }
  return hi;
}

double sidak(double alpha, int64_t n) { return -std::expm1(std::log1p(-alpha) / static_cast<double>(n)); }

::testing::AssertionResult mean_is(const Estimate& e, double exact, const MeanTest& test) {
  const double half = e.n > 1 ? student_quantile(test.alpha, e.n - 1) * e.standard_error : 0;
  const double rounding = test.rounding * std::fabs(exact);
  const auto text = [&](const char* what) {
    return ::testing::AssertionFailure()
           << what << ": mean " << e.mean << " +- " << half << " (standard error " << e.standard_error << ", "
           << e.n << " batches), exact " << exact << ", ratio " << e.mean / exact;
  };
  if (!std::isfinite(e.mean)) return text("not finite");
  if (half > test.resolution * std::fabs(exact)) return text("too noisy to tell");
  if (std::fabs(e.mean - exact) > half + rounding) return text("outside of the interval");
  return ::testing::AssertionSuccess();
}

double welch_p(const Estimate& a, const Estimate& b) {
  const double va = a.standard_error * a.standard_error, vb = b.standard_error * b.standard_error;
  const double v = va + vb;
  if (!(v > 0)) return a.mean == b.mean ? 1 : 0;
  const double dof = v * v / (va * va / (a.n - 1) + vb * vb / (b.n - 1));
  return student_two_sided((a.mean - b.mean) / std::sqrt(v), dof);
}

::testing::AssertionResult means_agree(const Estimate& a, const Estimate& b, const MeanTest& test) {
  const double va = a.standard_error * a.standard_error, vb = b.standard_error * b.standard_error;
  const double v = va + vb, larger = std::max(std::fabs(a.mean), std::fabs(b.mean));
  const double dof = v > 0 ? v * v / (va * va / (a.n - 1) + vb * vb / (b.n - 1)) : 1;
  const double half = student_quantile(test.alpha, dof) * std::sqrt(v);
  const auto text = [&](const char* what) {
    return ::testing::AssertionFailure()
           << what << ": " << a.mean << " (" << a.standard_error << ") against " << b.mean << " ("
           << b.standard_error << "), ratio " << a.mean / b.mean << ", half width " << half;
  };
  if (!std::isfinite(a.mean) || !std::isfinite(b.mean)) return text("not finite");
  if (half > test.resolution * larger) return text("too noisy to tell");
  if (std::fabs(a.mean - b.mean) > half + test.rounding * larger) return text("the means differ");
  return ::testing::AssertionSuccess();
}

ChiSquare chi_square(std::span<const double> observed, std::span<const double> expected, double pool_below) {
  ChiSquare c;
  int bins = 0;
  auto add = [&](double o, double e) {
    c.statistic += (o - e) * (o - e) / e;
    ++bins;
  };
  double pooled_o = 0, pooled_e = 0;
  for (size_t i = 0; i < observed.size(); ++i) {
    if (expected[i] >= pool_below) {
      add(observed[i], expected[i]);
      continue;
    }
    pooled_o += observed[i];
    pooled_e += expected[i];
    if (pooled_e >= pool_below) {
      add(pooled_o, pooled_e);
      pooled_o = pooled_e = 0;
    }
  }
  // What is left over is too small for a bin of its own; many counts where next to none are
  // expected still tell.
  if (pooled_o > 0) add(pooled_o, std::max(pooled_e, pool_below));
  c.dof = std::max(bins - 1, 1);
  c.p = upper_gamma(0.5 * c.dof, 0.5 * c.statistic);
  return c;
}

::testing::AssertionResult chi_square_passes(const ChiSquare& c, int64_t family, double alpha) {
  if (c.p >= sidak(alpha, family)) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "chi^2 " << c.statistic << " with " << c.dof
                                       << " degrees of freedom, p = " << c.p << " of a family of " << family;
}

uint32_t Random::bits() {
  const uint64_t old = state_;
  state_ = old * 6364136223846793005ull + 1442695040888963407ull;
  const auto x = static_cast<uint32_t>(((old >> 18) ^ old) >> 27);
  const auto rotation = static_cast<int>(old >> 59);
  return std::rotr(x, rotation);
}

}  // namespace lightmill::test
