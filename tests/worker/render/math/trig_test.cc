// Sine and cosine against the library's, and equal bits in lanes.
#include "worker/render/math/trig.h"

#include <gtest/gtest.h>

#include <cmath>

#include "worker/render/math/exp.h"

namespace lightmill::test {
namespace {

TEST(Trig, SineAndCosineOfTurns) {
  for (int i = 0; i <= 100000; ++i) {
    const float u = static_cast<float>(i) / 100000;
    float s, c;
    sincos_2pi(u, &s, &c);
    ASSERT_NEAR(s, std::sin(2 * M_PI * double{u}), 2e-7) << u;
    ASSERT_NEAR(c, std::cos(2 * M_PI * double{u}), 2e-7) << u;
    Float8 s8, c8;
    sincos_2pi(splat<Float8>(u), &s8, &c8);
    ASSERT_EQ(float_bits(s8[3]), float_bits(s));
    ASSERT_EQ(float_bits(c8[5]), float_bits(c));
  }
}

TEST(Trig, ExponentialOfNegatives) {
  for (int i = 0; i <= 100000; ++i) {
    const float x = -static_cast<float>(i) / 1250;  // to -80, where it is clamped
    const float e = exp_negative(x);
    const double exact = std::exp(double{x});
    ASSERT_NEAR(e, exact, 1e-6 * exact + 1e-37) << x;
    ASSERT_EQ(float_bits(exp_negative(splat<Float8>(x))[6]), float_bits(e));
  }
  EXPECT_EQ(exp_negative(0.0f), 1.0f);
  EXPECT_LE(exp_negative(-1e30f), 1e-30f);
}

TEST(Trig, LogarithmOfPositives) {
  for (int i = -30000; i <= 30000; ++i) {
    const auto x = static_cast<float>(std::exp2(i / 240.0));  // 2^-125 to 2^125
    const float l = log_positive(x);
    const double exact = std::log(double{x});
    ASSERT_NEAR(l, exact, 3e-7 * std::max(1.0, std::fabs(exact))) << x;
    ASSERT_EQ(float_bits(log_positive(splat<Float8>(x))[2]), float_bits(l));
  }
  EXPECT_EQ(log_positive(1.0f), 0.0f);
}

TEST(Trig, LogarithmOfOneMinus) {
  const auto check = [](float x, float rest, double exact) {
    const float l = minus_log_one_minus(x, rest);
    ASSERT_NEAR(l / exact, 1, 4e-7) << x;
    ASSERT_EQ(float_bits(minus_log_one_minus(splat<Float8>(x), splat<Float8>(rest))[1]), float_bits(l));
  };
  for (int i = 1; i < 4000; ++i) {
    const auto x = static_cast<float>(std::exp2(-i / 80.0));  // from 2^-50 to nearly 1
    check(x, 1 - x, -std::log1p(-double{x}));
    check(1 - x, x, i < 41 ? -std::log1p(-double{1 - x}) : -std::log(double{x}));
  }
  EXPECT_EQ(minus_log_one_minus(0.0f, 1.0f), 0.0f);
}

}  // namespace
}  // namespace lightmill::test
