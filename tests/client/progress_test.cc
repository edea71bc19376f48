#include "client/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lightmill::client {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ProgressLine, ShowsWhatIsKnown) {
  JobStatus status;
  status.state = JobState::kRunning;
  status.settings.spp = 64;
  status.packets_done = 37;
  status.packets_total = 100;
  status.spp = 24;
  EXPECT_THAT(progress_line(status), HasSubstr("37 %"));
  EXPECT_THAT(progress_line(status), HasSubstr("24/64 spp"));
  EXPECT_THAT(progress_line(status), Not(HasSubstr("ETA")));
  EXPECT_THAT(progress_line(status), Not(HasSubstr("relMSE")));
  status.samples_per_second = 1.31e6;
  status.eta_seconds = 75;
  status.relmse = 0.01;
  status.relmse_low = 0.008;
  status.relmse_high = 0.012;
  EXPECT_THAT(progress_line(status), HasSubstr("1.31 Msamples/s"));
  EXPECT_THAT(progress_line(status), HasSubstr("ETA 1 min 15 s"));
  EXPECT_THAT(progress_line(status), HasSubstr("relMSE 0.01 ±0.002"));
}

TEST(Progress, QuietPrintsNothingAndLinesAreThrottled) {
  JobStatus status;
  status.state = JobState::kRunning;
  ::testing::internal::CaptureStderr();
  Progress quiet(true);
  quiet.update(status);
  quiet.finish(status);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  ::testing::internal::CaptureStderr();
  Progress loud(false);
  for (int i = 0; i < 100; ++i) {
    status.tiles_committed = i;
    loud.update(status);
  }
  const std::string text = ::testing::internal::GetCapturedStderr();
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 2);
}

TEST(DurationText, PicksUnits) {
  EXPECT_EQ(duration_text(0.2), "0 s");
  EXPECT_EQ(duration_text(125), "2 min 5 s");
  EXPECT_EQ(duration_text(7500), "2 h 5 min");
}

}  // namespace
}  // namespace lightmill::client
