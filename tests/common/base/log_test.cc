#include "common/base/log.h"

#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "common/base/error.h"

namespace lightmill {
namespace {

/// What `log` writes to stderr as JSON, a value to a line.
template <class F>
std::vector<nlohmann::json> lines_of(F log) {
  testing::internal::CaptureStderr();
  start_log("tester", "info", "json");
  log();
  spdlog::default_logger()->flush();
  std::istringstream text(testing::internal::GetCapturedStderr());
  std::vector<nlohmann::json> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

TEST(Log, JsonLinesHaveTimeLevelProgramAndMessage) {
  const auto lines = lines_of([] {
    spdlog::info("a \"quoted\"\nmessage \xff");
    spdlog::debug("not asked for");
    spdlog::error("bad");
  });
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0]["level"], "info");
  EXPECT_EQ(lines[0]["program"], "tester");
  EXPECT_EQ(lines[0]["message"], "a \"quoted\"\nmessage \xEF\xBF\xBD");
  EXPECT_EQ(lines[0]["time"].get<std::string>().size(), std::string("2026-11-21T16:43:13.325Z").size());
  EXPECT_EQ(lines[0].size(), 4u) << "no context, no keys of it";
  EXPECT_EQ(lines[1]["level"], "error");
}

TEST(Log, ScopesNestAndBelongToTheirThread) {
  const auto lines = lines_of([] {
    const LogScope outer({"j1", 3, 2, "w4"});
    {
      const LogScope inner({.tile = 5});
      spdlog::info("inner");
    }
    spdlog::info("outer");
    std::thread([] { spdlog::info("another"); }).join();
  });
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0]["job"], "j1");
  EXPECT_EQ(lines[0]["tile"], 5);
  EXPECT_EQ(lines[0]["worker"], "w4");
  EXPECT_EQ(lines[1]["tile"], 3);
  EXPECT_EQ(lines[1]["attempt"], 2);
  EXPECT_FALSE(lines[2].contains("job"));
  EXPECT_TRUE(log_context().job.empty());
}

TEST(Log, UnknownFormatsAreRefused) { EXPECT_THROW(start_log("tester", "info", "xml"), Error); }

}  // namespace
}  // namespace lightmill
