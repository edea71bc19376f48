#include "coordinator/service/tile_log.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(TileLog, FindsTheLinesOfAJobAndOfATileInOrder) {
  TileLog log;
  for (int64_t tile = 0; tile < 3; ++tile) {
    const LogScope scope({"j1", tile, 1, "w1"});
    log.add("first of " + std::to_string(tile));
    log.add("second of " + std::to_string(tile));
  }
  {
    const LogScope scope({"j2", 1, 4, "w2"});
    log.add("another job");
  }
  log.add("about nothing");
  const auto of_tile = log.of(JobId{"j1"}, TileId{1}, 100);
  ASSERT_EQ(of_tile.size(), 2u);
  EXPECT_EQ(of_tile[0].text, "first of 1");
  EXPECT_EQ(of_tile[1].text, "second of 1");
  EXPECT_EQ(of_tile[0].about.worker, "w1");
  EXPECT_LE(of_tile[0].time, of_tile[1].time);
  EXPECT_EQ(log.of(JobId{"j1"}, std::nullopt, 100).size(), 6u);
  const auto newest = log.of(JobId{"j1"}, std::nullopt, 2);
  ASSERT_EQ(newest.size(), 2u);
  EXPECT_EQ(newest[1].text, "second of 2");
  EXPECT_EQ(log.of(JobId{"j2"}, std::nullopt, 100).at(0).about.attempt, 4);
  EXPECT_TRUE(log.of(JobId{"j3"}, std::nullopt, 100).empty());
}

TEST(TileLog, IsBounded) {
  TileLog log;
  const LogScope scope({.job = "j1", .tile = 0});
  for (size_t i = 0; i < TileLog::kMaxLines + 10; ++i) log.add(std::to_string(i));
  log.add(std::string(10 * TileLog::kMaxTextBytes, 'x'));
  const auto lines = log.of(JobId{"j1"}, std::nullopt, 10 * TileLog::kMaxLines);
  ASSERT_EQ(lines.size(), TileLog::kMaxLines);
  EXPECT_EQ(lines.front().text, "11");
  EXPECT_EQ(lines.back().text.size(), TileLog::kMaxTextBytes);
}

}  // namespace
}  // namespace lightmill
