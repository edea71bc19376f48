#include "common/error/error_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "common/base/statistics/student_t.h"
#include "common/error/comparison.h"
#include "common/error/report/report.h"
#include "common/error/report/report_files.h"
#include "tests/common/image/temp_folder.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A curve of a picture of `values` values with normal noise of variance 1/N, true errors and all, plus
/// `bias`.
ErrorCurve simulated(int values, double bias, std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  std::vector<double> sum(static_cast<size_t>(values));
  ErrorCurve curve;
  int64_t n = 0;
  for (int64_t next = 64; next <= 4096; next = next * 5 / 4) {
    const double step = std::sqrt(static_cast<double>(next - n));
    double square = 0;
    for (double& s : sum) {
      s += step * normal(rng);
      const double error = s / static_cast<double>(next) + bias;
      square += error * error / values;
    }
    n = next;
    const double sigma = std::sqrt(2.0 / values), t = student_t_975(16 * 15 / 2),
                 spp = static_cast<double>(n);
    ErrorPoint p;
    p.wall_seconds = 0.01 * spp;
    p.cpu_seconds = 0.02 * spp;
    p.spp = spp;
    p.batches = 16;
    p.relmse = 1 / spp;
    p.relmse_low = (1 - t * sigma) / spp;
    p.relmse_high = (1 + t * sigma) / spp;
    p.true_relmse = square;
    curve.points.push_back(p);
  }
  return curve;
}

TEST(ErrorFit, TheSlopesIntervalHoldsTheTruth) {
  std::mt19937_64 rng(1);
  constexpr int kTrials = 300;
  int covered = 0, flat = 0;
  for (int i = 0; i < kTrials; ++i) {
    const ErrorCurve curve = simulated(200, 0, rng);
    const auto fit = fit_error(curve, true);
    ASSERT_TRUE(fit);
    covered += fit->slope_low <= -1 && -1 <= fit->slope_high;
    flat += flattening(curve).has_value();
  }
  // 95 % with a standard deviation of 1.3 %: four of them.
  EXPECT_NEAR(covered / double{kTrials}, 0.95, 0.05);
  EXPECT_LE(flat, kTrials / 40 + 4 * 3) << "by chance once in 40";
}

TEST(ErrorFit, ABiasFlattensAndIsCalledOut) {
  std::mt19937_64 rng(2);
  const ErrorCurve curve = simulated(500, 0.03, rng);
  const auto fit = fit_error(curve, true);
  ASSERT_TRUE(fit);
  EXPECT_GT(fit->slope_low, -1);
  const auto flat = flattening(curve);
  ASSERT_TRUE(flat);
  EXPECT_NEAR(flat->floor, 9e-4, 3e-4);
  EXPECT_THAT(curve_statements(curve), HasSubstr("does not fall with more samples"));
  EXPECT_THAT(curve_statements(simulated(500, 0, rng)), Not(HasSubstr("does not fall")));
  ErrorCurve estimated = curve;
  for (ErrorPoint& p : estimated.points) p.true_relmse.reset();
  EXPECT_FALSE(flattening(estimated)) << "without a reference nobody knows";
}

TEST(ErrorFit, TooLittleIsNotFitted) {
  std::mt19937_64 rng(3);
  ErrorCurve curve = simulated(100, 0, rng);
  curve.points.resize(2);
  EXPECT_FALSE(fit_error(curve, false));
  EXPECT_FALSE(fit_error({}, false));
  EXPECT_FALSE(outlook({}));
  ErrorCurve still = simulated(100, 0, rng);
  for (ErrorPoint& p : still.points) p.wall_seconds = 1;
  EXPECT_FALSE(fit_error(still, false));
  for (ErrorPoint& p : still.points) p.relmse_high = p.relmse_low = p.relmse = 0.0;
  EXPECT_FALSE(fit_error(still, false));
}

TEST(ErrorFit, OutlookFollowsThePace) {
  std::mt19937_64 rng(4);
  ErrorCurve curve = simulated(100, 0, rng);
  for (ErrorPoint& p : curve.points) p.wall_seconds += 5;  // a slow start does not count
  const auto o = outlook(curve);
  ASSERT_TRUE(o);
  const double spp = curve.points.back().spp;
  EXPECT_NEAR(o->seconds(2, 1), 0.01 * spp, 1e-9);
  EXPECT_NEAR(o->seconds(10, 4), 9 * 0.01 * spp / 4, 1e-9);
}

TEST(Comparison, EfficienciesAreOfTheBestWithConfidence) {
  std::mt19937_64 rng(5);
  ErrorCurve fast = simulated(1000, 0, rng), slow = simulated(1000, 0, rng), none;
  fast.job_name = "fast";
  slow.job_name = "slow, \"really\"";
  none.job_name = "none";
  for (ErrorPoint& p : slow.points) p.cpu_seconds *= 2;
  const std::vector<Efficiency> rows = efficiencies({slow, fast, none});
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_TRUE(rows[0].of_truth);
  EXPECT_EQ(rows[1].relative, 1);
  EXPECT_FALSE(rows[1].relative_low);
  ASSERT_TRUE(rows[0].relative_low);
  EXPECT_LT(*rows[0].relative_low, 0.5);
  EXPECT_GT(*rows[0].relative_high, 0.5);
  EXPECT_LT(*rows[0].relative_high, 0.7);

  const testing::TempFolder folder;
  write_comparison(folder / "out", {slow, fast, none});
  std::ifstream csv(folder / "out/error.csv");
  std::string header, row;
  std::getline(csv, header);
  std::getline(csv, row);
  EXPECT_THAT(header, HasSubstr("run,wall_s"));
  EXPECT_EQ(row.substr(0, 19), "\"slow, \"\"really\"\"\",");
  const std::string svg = error_svg({slow, fast, none});
  EXPECT_THAT(svg, HasSubstr("lm-line1"));
  EXPECT_THAT(svg, HasSubstr("slow, &quot;really&quot;"));
}

}  // namespace
}  // namespace lightmill
