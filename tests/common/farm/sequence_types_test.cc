// Names of sequences and frames, there and back.
#include "common/farm/sequence_types.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(SequenceTypes, FramesAreNamedByTheirSequence) {
  for (const int number : {0, 7, -3, 2147483647, -2147483647 - 1}) {
    const FrameOf frame{SequenceId{"s12"}, number};
    EXPECT_EQ(frame_of(frame_job(frame)), frame) << number;
  }
  for (const char* other : {"j7", "s1", "s1.", "s1.x", "s1.1.2", "s.1", "s0.1", "s01.1", "s1.01", "s1.+1",
                            "s1.-0", "s1.2147483648", "s-1.1", "", ".", "S1.1", "s1 .1"}) {
    EXPECT_FALSE(frame_of(JobId{other})) << other;
  }
}

TEST(SequenceTypes, KnowsIdsOfSequences) {
  for (const char* id : {"s1", "s123"}) EXPECT_TRUE(is_sequence_id(id)) << id;
  for (const char* id : {"", "s", "s0", "s-1", "s01", "s1.2", "j1", "s1x", "scene", "s99999999999999999999"})
    EXPECT_FALSE(is_sequence_id(id)) << id;
}

TEST(SequenceTypes, OrdersHaveNames) {
  for (const FrameOrder order : {FrameOrder::kSequential, FrameOrder::kCoarseFirst})
    EXPECT_EQ(frame_order_from_name(frame_order_name(order)), order);
  EXPECT_FALSE(frame_order_from_name("backwards"));
}

}  // namespace
}  // namespace lightmill
