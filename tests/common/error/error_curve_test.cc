#include "common/error/error_curve.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/error.h"
#include "common/base/statistics/student_t.h"
#include "common/error/error_estimate.h"

namespace lightmill {
namespace {

TEST(ErrorCurve, JsonRoundTripsWithUnknownValues) {
  ErrorCurve curve;
  curve.job_name = "a \"name\"";
  curve.points.push_back({1.25, 2.5, 16, {}, {}, {}, 1, {}, {}, {}});
  curve.points.push_back({2.5, 5, 32.5, 0.1, 0.05, 0.15, 2, 0.11, 0.09, 0.2});
  const ErrorCurve back = curve_from_json(curve_to_json(curve));
  EXPECT_EQ(back.job_name, curve.job_name);
  ASSERT_EQ(back.points.size(), 2u);
  EXPECT_FALSE(back.points[0].relmse);
  EXPECT_FALSE(back.points[0].true_flip);
  EXPECT_EQ(back.points[1].wall_seconds, 2.5);
  EXPECT_EQ(back.points[1].cpu_seconds, 5);
  EXPECT_EQ(back.points[1].spp, 32.5);
  EXPECT_EQ(back.points[1].relmse, 0.1);
  EXPECT_EQ(back.points[1].relmse_low, 0.05);
  EXPECT_EQ(back.points[1].relmse_high, 0.15);
  EXPECT_EQ(back.points[1].batches, 2);
  EXPECT_EQ(back.points[1].true_relmse, 0.11);
  EXPECT_EQ(back.points[1].true_relmse_trimmed, 0.09);
  EXPECT_EQ(back.points[1].true_flip, 0.2);
  EXPECT_EQ(curve_to_json(back), curve_to_json(curve));
}

TEST(ErrorCurve, JsonRoundTripsWithFiguresOfBoxes) {
  ErrorCurve curve;
  curve.points.emplace_back();
  curve.points[0].boxes = {BoxError{0.1, 0.05, 0.2, 0.15}, BoxError{0.3, {}, {}, {}}, BoxError{}};
  const std::string text = curve_to_json(curve);
  for (const char* part :
       {R"("relmse_4":0.1)", R"("relmse_4_low":0.05)", R"("relmse_4_high":0.2)", R"("true_relmse_4":0.15)",
        R"("relmse_16":0.3)", R"("relmse_16_low":null)", R"("true_relmse_16":null)", R"("relmse_32":null)"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part;
  }
  const ErrorCurve back = curve_from_json(text);
  ASSERT_EQ(back.points.size(), 1u);
  EXPECT_EQ(back.points[0].boxes, curve.points[0].boxes);
}

TEST(ErrorCurve, JsonOfOlderVersionsHasNoFiguresOfBoxes) {
  const ErrorCurve curve = curve_from_json(
      R"({"job_name":"a","points":[{"wall_seconds":1,"cpu_seconds":2,"spp":16,"relmse":0.5,"batches":2}]})");
  ASSERT_EQ(curve.points.size(), 1u);
  EXPECT_EQ(curve.points[0].relmse, 0.5);
  EXPECT_EQ(curve.points[0].boxes, BoxErrors());
}

TEST(ErrorCurve, MalformedJsonIsAnError) {
  for (
      const char* text :
      {"", "{", "[]", "{}", R"({"job_name":1,"points":[]})", R"({"job_name":"a","points":[1]})",
       R"({"job_name":"a","points":[{"wall_seconds":"x"}]})",
       R"({"job_name":"a","points":[{"wall_seconds":1,"cpu_seconds":2,"spp":1,"batches":2,"relmse_4":"x"}]})"}) {
    EXPECT_THROW(curve_from_json(text), Error) << text;
  }
}

/// P(T <= x) by Simpson's rule over the density of Student's t.
double student_cdf(double x, int dof) {
  const double n = dof;
  const double scale = std::exp(std::lgamma((n + 1) / 2) - std::lgamma(n / 2)) / std::sqrt(n * M_PI);
  const auto density = [&](double t) { return scale * std::pow(1 + t * t / n, -(n + 1) / 2); };
  const int steps = 20000;
  const double h = x / steps;
  double sum = density(0) + density(x);
  for (int i = 1; i < steps; ++i) sum += (i % 2 ? 4 : 2) * density(i * h);
  return 0.5 + sum * h / 3;
}

TEST(StudentT, QuantilesMatchTheDistribution) {
  for (const int dof : {1, 2, 3, 4, 5, 7, 10, 15, 16, 20, 25, 30, 31, 32, 40, 100}) {
    EXPECT_NEAR(student_cdf(student_t_975(dof), dof), 0.975, 1e-6) << dof;
  }
  for (int dof = 2; dof < 60; ++dof) EXPECT_LT(student_t_975(dof), student_t_975(dof - 1));
  EXPECT_THROW(student_t_975(0), std::logic_error);
}

}  // namespace
}  // namespace lightmill
