#include "common/film/dropped.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "common/film/dropped_text.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;

constexpr int kExponent = -52;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();

TEST(Dropped, WhatTheSumsRefuseIsToldApart) {
  Dropped dropped;
  dropped.refuse({kNan, 1, -1}, kExponent, 0.5);
  dropped.refuse({1, -kInf, 1}, kExponent, 2);
  dropped.refuse({1, 2, -3}, kExponent, 1);
  dropped.refuse({-1, 0x1p40f, 0}, kExponent, 1);
  dropped.refuse({3e38f, 3e38f, 3e38f}, kExponent, 1);
  EXPECT_EQ(dropped.of(DropKind::kNotFinite), (Dropped::Kind{2, 2.5}));
  EXPECT_EQ(dropped.of(DropKind::kNegative), (Dropped::Kind{1, 2}));
  EXPECT_EQ(dropped.of(DropKind::kOutOfRange).count, 2u);
  EXPECT_NEAR(dropped.of(DropKind::kOutOfRange).amount, 3e38, 1e31) << "no sum overflows";
  EXPECT_EQ(dropped.refused(), 5u);
  EXPECT_TRUE(dropped.any());
}

TEST(Dropped, BlackIsNotBelowTheRange) {
  Dropped dropped;
  dropped.round_to_zero({0, -0.0f, 0});
  EXPECT_FALSE(dropped.any());
  dropped.round_to_zero({0, 3e-20f, -3e-20f});
  EXPECT_EQ(dropped.of(DropKind::kBelowRange).count, 1u);
  EXPECT_NEAR(dropped.of(DropKind::kBelowRange).amount, 2e-20, 1e-26);
  EXPECT_EQ(dropped.refused(), 0u);
}

TEST(Dropped, IsAddedAndTakenBack) {
  Dropped a, b;
  a.add(DropKind::kCapped, 0.1);
  b.add(DropKind::kCapped, 0.2);
  b.add(DropKind::kNegative, 4);
  a.add(b, 0.5);
  EXPECT_EQ(a.of(DropKind::kCapped), (Dropped::Kind{2, 0.1 + 0.2 * 0.5}));
  EXPECT_EQ(a.of(DropKind::kNegative), (Dropped::Kind{1, 2}));
  a.subtract(b);
  EXPECT_EQ(a.of(DropKind::kCapped).count, 1u);
  EXPECT_EQ(a.of(DropKind::kNegative), Dropped::Kind{});
  a.subtract(b);
  EXPECT_FALSE(a.any());
  EXPECT_EQ(a, Dropped{}) << "amounts go with the last count";
}

TEST(DroppedShares, AreOfTheLightThatTheImageWouldHave) {
  Dropped dropped;
  dropped.add(DropKind::kNotFinite, 30);
  dropped.add(DropKind::kOutOfRange, 300);
  dropped.add(DropKind::kCapped, 1e37);
  const DroppedShares shares = shares_of(dropped, 100, 9);
  EXPECT_DOUBLE_EQ(*shares[0].share, 0.3);
  EXPECT_EQ(shares[1], DroppedShare{});
  EXPECT_DOUBLE_EQ(*shares[2].share, 0.25);
  EXPECT_DOUBLE_EQ(*shares[3].share, 1);
  EXPECT_EQ(shares_of(dropped, 100, std::nullopt)[0].share, 0.3);
  EXPECT_EQ(shares_of(dropped, 100, std::nullopt)[2], (DroppedShare{1, std::nullopt}));
  EXPECT_EQ(shares_of(dropped, 100, 0)[2].share, 1) << "the image is black";
}

TEST(DroppedLines, WarnAboveAThousandth) {
  EXPECT_TRUE(dropped_lines({}, 0).empty());
  DroppedShares dropped{};
  dropped[0] = {1, 0.0005};
  dropped[2] = {12, 0.02};
  dropped[4] = {1000, 1e-9};
  const std::vector<DroppedLine> lines = dropped_lines(dropped, 13);
  ASSERT_EQ(lines.size(), 2u) << "what nobody can see is not told";
  EXPECT_EQ(lines[0],
            (DroppedLine{"1 contribution was not finite and was dropped, in at most 0.05 % of the samples",
                         false}));
  EXPECT_TRUE(lines[1].warning);
  EXPECT_THAT(lines[1].text, HasSubstr("12 contributions were too bright"));
  EXPECT_THAT(lines[1].text, HasSubstr("about 2 % of the image; make"));
}

TEST(DroppedLines, WhatOlderVersionsCountedIsNotLost) {
  DroppedShares dropped{};
  dropped[1] = {3, 1e-5};
  const std::vector<DroppedLine> lines = dropped_lines(dropped, 10);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_THAT(lines[1].text, HasSubstr("7 contributions were not finite, negative or too bright"));
  EXPECT_TRUE(lines[1].warning);
  dropped[1].share.reset();
  EXPECT_EQ(dropped_lines(dropped, 3),
            (std::vector<DroppedLine>{{"3 samples were negative and were dropped", false}}));
}

}  // namespace
}  // namespace lightmill
