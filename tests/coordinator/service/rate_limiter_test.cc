#include "coordinator/service/limits/rate_limiter.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(RateLimiter, BurstThenRate) {
  RateLimiter limiter(2, 3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(limiter.take("ann", 10), 0);
  EXPECT_DOUBLE_EQ(limiter.take("ann", 10), 0.5);
  EXPECT_EQ(limiter.take("bob", 10), 0) << "another name has a bucket of its own";
  EXPECT_GT(limiter.take("ann", 10.4), 0);
  EXPECT_EQ(limiter.take("ann", 10.5), 0);
  EXPECT_GT(limiter.take("ann", 9), 0) << "a clock that jumps back gives nothing";
  int taken = 0;
  for (int i = 0; i < 1000; ++i) taken += limiter.take("ann", 100 + i * 0.01) == 0;
  EXPECT_NEAR(taken, 3 + 2 * 10, 1);
}

TEST(RateLimiter, CrowdsOfNamesShareABucket) {
  RateLimiter limiter(1, 2);
  int taken = 0;
  for (int i = 0; i < 100000; ++i) taken += limiter.take("host" + std::to_string(i), 5) == 0;
  EXPECT_LE(taken, 4096 + 2) << "memory is bounded, and so is what a crowd gets";
  EXPECT_EQ(limiter.take("late", 50), 0) << "those that were idle are forgotten";
}

}  // namespace
}  // namespace lightmill
