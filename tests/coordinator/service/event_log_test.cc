#include "coordinator/service/event_log.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(EventLog, KeepsTheNewestLines) {
  EventLog log;
  EXPECT_TRUE(log.after(0).empty());
  for (size_t i = 1; i <= EventLog::kMaxLines + 10; ++i) log.add(std::to_string(i));
  EXPECT_EQ(log.newest(), EventLog::kMaxLines + 10);
  EXPECT_EQ(log.after(0).size(), EventLog::kMaxLines);
  EXPECT_EQ(log.after(0).front().text, "11");
  ASSERT_EQ(log.after(EventLog::kMaxLines + 8).size(), 2u);
  EXPECT_EQ(log.after(EventLog::kMaxLines + 8).front().number, EventLog::kMaxLines + 9);
  EXPECT_TRUE(log.after(log.newest() + 5).empty());
  log.add(std::string(5000, 'x'));
  EXPECT_EQ(log.after(log.newest() - 1).front().text.size(), EventLog::kMaxLineBytes);
}

}  // namespace
}  // namespace lightmill
