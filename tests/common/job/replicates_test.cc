#include "common/job/replicates.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>

namespace lightmill {
namespace {

TEST(Replicates, EachGetsItsSuperblocksInOrder) {
  std::array<int64_t, kReplicates> next{};
  for (int64_t k = 0; k < 5000; ++k) {
    const ReplicateBlock block = replicate_of(k);
    EXPECT_EQ(block.superblock, next[static_cast<size_t>(block.replicate)]++) << k;
    // As many each at powers of two; never far from it.
    if (((k + 1) & k) == 0 && k > 0) {
      EXPECT_EQ(next[0], next[1]) << k;
    }
    EXPECT_LE(next[0], std::max<int64_t>(1, 2 * next[1])) << k;
    EXPECT_LE(next[1], next[0]) << k;
  }
}

TEST(Replicates, ARunIsOfOneReplicate) {
  for (int64_t k = 0; k < 5000; ++k) {
    const int64_t end = replicate_run_end(k);
    ASSERT_GT(end, k);
    EXPECT_EQ(replicate_of(end - 1).replicate, replicate_of(k).replicate);
    EXPECT_EQ(replicate_of(end - 1).superblock - replicate_of(k).superblock, end - 1 - k);
    EXPECT_NE(replicate_of(end).replicate, replicate_of(k).replicate);
  }
  EXPECT_EQ(replicate_run_end(3), 4);
  EXPECT_EQ(replicate_run_end(4), 6);
  EXPECT_EQ(replicate_run_end(129), 192);
}

}  // namespace
}  // namespace lightmill
