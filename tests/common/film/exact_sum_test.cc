#include "common/film/exact_sum.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "common/film/signed_sum.h"

namespace lightmill {
namespace {

constexpr int kQ = -52;

Units units(float x, int q = kQ) { return to_units(x, q).value(); }

TEST(ExactSum, SumsAreIdenticalInAnyOrderAndAnyGrouping) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<float> exponent(-60, 30);
  std::vector<float> values(4000);
  for (float& v : values) v = std::exp2(exponent(rng));
  Units expected = 0;
  for (const float v : values) expected += units(v);
  for (int trial = 0; trial < 20; ++trial) {
    std::shuffle(values.begin(), values.end(), rng);
    std::vector<Units> parts(1 + rng() % 9, 0);
    for (const float v : values) parts[rng() % parts.size()] += units(v);
    std::shuffle(parts.begin(), parts.end(), rng);
    Units sum = 0;
    for (const Units part : parts) sum += part;
    EXPECT_TRUE(sum == expected);
  }
}

TEST(ExactSum, RepresentableValuesAreExact) {
  for (const float v : {1.0f, 0.1f, 3.25e-5f, 1e6f, 0x1p-28f}) {
    EXPECT_EQ(from_units(units(v), kQ), static_cast<double>(v));
  }
  EXPECT_TRUE(units(0.0f) == 0);
  EXPECT_TRUE(units(-0.0f) == 0);
}

TEST(ExactSum, RoundsHalfUpToTheQuantum) {
  EXPECT_TRUE(units(0x1p-52f) == 1);
  EXPECT_TRUE(units(0x1p-53f) == 1);                        // half
  EXPECT_TRUE(units(std::nextafter(0x1p-53f, 0.0f)) == 0);  // just below
  EXPECT_TRUE(units(1.5f * 0x1p-52f) == 2);
  EXPECT_TRUE(units(1.25f * 0x1p-52f) == 1);
  EXPECT_TRUE(units(0x1p-100f) == 0);
  EXPECT_TRUE(units(0x1p-77f) == 0);  // the largest shift
}

TEST(ExactSum, DenormalsAreSummedExactlyAtAScaleOfTheirOwn) {
  const float least = std::numeric_limits<float>::denorm_min();
  EXPECT_TRUE(units(least, -149) == 1);
  EXPECT_TRUE(units(3 * least, -149) == 3);
  EXPECT_TRUE(units(std::numeric_limits<float>::min(), -149) == (Units{1} << 23));
  EXPECT_TRUE(units(least, -150) == 2);
  EXPECT_TRUE(units(least, kQ) == 0);
}

TEST(ExactSum, RefusesWhatCanNotBeSummed) {
  EXPECT_FALSE(to_units(-1.0f, kQ));
  EXPECT_FALSE(to_units(-std::numeric_limits<float>::denorm_min(), kQ));
  EXPECT_FALSE(to_units(std::numeric_limits<float>::infinity(), kQ));
  EXPECT_FALSE(to_units(-std::numeric_limits<float>::infinity(), kQ));
  EXPECT_FALSE(to_units(std::numeric_limits<float>::quiet_NaN(), kQ));
  EXPECT_FALSE(to_units(0x1p40f, kQ));  // 2^92 units
  EXPECT_TRUE(to_units(std::nextafter(0x1p40f, 0.0f), kQ));
  EXPECT_FALSE(to_units(std::numeric_limits<float>::max(), -149));
}

TEST(ExactSum, ScaledValuesHaveTheSameUnits) {
  for (const int k : {-40, -3, 17, 60}) {
    EXPECT_TRUE(units(std::ldexp(0.7331f, k), kQ + k) == units(0.7331f, kQ));
  }
}

TEST(ExactSum, SignedUnitsCountDownFromZero) {
  for (const float x : {1.0f, 0.7331f, 123456.0f, 3e-9f}) {
    const Units up = to_signed_units(x, kQ).value(), down = to_signed_units(-x, kQ).value();
    EXPECT_TRUE(up == units(x));
    EXPECT_TRUE(up + down == 0);
    EXPECT_TRUE(magnitude(down) == up);
    EXPECT_EQ(is_negative(down), up != 0);
    EXPECT_EQ(from_signed_units(down, kQ), -from_units(up, kQ));
    EXPECT_EQ(from_signed_units(down + down + up, kQ), -from_units(up, kQ));
  }
  EXPECT_TRUE(to_signed_units(-0.0f, kQ).value() == 0);
  EXPECT_FALSE(to_signed_units(-0x1p40f, kQ));
  EXPECT_FALSE(to_signed_units(std::numeric_limits<float>::quiet_NaN(), kQ));
}

TEST(ExactSum, ManyLargestContributionsFit) {
  const Units largest = units(std::nextafter(0x1p40f, 0.0f));
  EXPECT_TRUE(largest < (Units{1} << kMaxContributionBits));
  EXPECT_TRUE((largest << 34) >> 34 == largest);
  EXPECT_GT(from_units(largest << 34, kQ), 0);
}

}  // namespace
}  // namespace lightmill
