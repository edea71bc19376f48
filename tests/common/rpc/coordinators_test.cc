// Lists of coordinators: what is one, and how calls that fail go on to the next.
#include "common/rpc/coordinators.h"

#include <gtest/gtest.h>

#include "common/base/error.h"

namespace lightmill {
namespace {

TEST(Coordinators, AreOneOrSeveral) {
  const Coordinators one("localhost:7070");
  EXPECT_EQ(one.size(), 1u);
  const Coordinators three("a:1,b.example.org:2,[::1]:3");
  ASSERT_EQ(three.size(), 3u);
  EXPECT_EQ(three.address(1), "b.example.org:2");
  EXPECT_EQ(three.address(2), "[::1]:3");
  for (const char* bad : {"", "a:1,", ",a:1", "a:1,,b:2", "a:1, b:2", "a:x"}) {
    EXPECT_THROW(Coordinators{bad}, Error) << bad;
  }
  std::string many = "a:1";
  for (int i = 0; i < 16; ++i) many += ",a:1";
  EXPECT_THROW(Coordinators{many}, Error);
}

TEST(Coordinators, MoveOnOnceForCallsThatFailTogether) {
  Coordinators two("a:1,b:2");
  EXPECT_EQ(two.current(), 0u);
  two.move_on(0);
  two.move_on(0);  // begun before the first one failed
  EXPECT_EQ(two.current(), 1u);
  two.move_on(1);
  EXPECT_EQ(two.current(), 0u);
  Coordinators one("a:1");
  one.move_on(0);
  EXPECT_EQ(one.current(), 0u);
}

}  // namespace
}  // namespace lightmill
