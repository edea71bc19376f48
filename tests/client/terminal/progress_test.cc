#include "client/terminal/progress.h"

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

TEST(ScalesText, ShowsWhatIsKnown) {
  JobStatus status;
  EXPECT_EQ(scales_text(status), "");
  status.boxes = {BoxError{0.0123456, {}, {}, {}}, BoxError{}, BoxError{2, 1, 3, {}}};
  EXPECT_EQ(scales_text(status), "4 px 0.0123, 32 px 2");
}

TEST(WaitingNote, SaysWhyNobodyWorksForAJob) {
  JobStatus status;
  status.id = JobId{"j7"};
  EXPECT_EQ(waiting_note(status), "");
  status.message = "waits for a worker: none is connected";
  EXPECT_EQ(waiting_note(status), "job j7 is queued: waits for a worker: none is connected");
  status.workers = 1;
  EXPECT_EQ(waiting_note(status), "") << "\"choosing strategies\" is in the line of progress";
  status.workers = 0;
  status.state = JobState::kFailed;
  EXPECT_EQ(waiting_note(status), "") << "why it failed is an error";
}

TEST(TurnText, IsHonestAboutWhatIsOnlyEstimated) {
  JobStatus status;
  EXPECT_EQ(turn_text(status), "");
  status.turn_seconds = 12 * 60 + 11;
  EXPECT_EQ(turn_text(status), "comes in about 12 min");
  status.eta_seconds = 3 * 3600;
  EXPECT_EQ(turn_text(status), "comes in about 12 min, done in about 3 h");
  status.turn_seconds = 0;
  status.eta_seconds = 3 * 86400;
  EXPECT_EQ(turn_text(status), "comes in less than a minute, done in about 3 days");
}

TEST(TargetNote, SaysWhatWasReachedAndWhatIsMissing) {
  JobStatus status;
  status.state = JobState::kDone;
  EXPECT_EQ(target_note(status), "") << "no target";
  EXPECT_FALSE(target_met(status));
  status.settings.target_error = 1e-3;
  status.wall_seconds = 10;
  status.spp = 24;
  EXPECT_THAT(target_note(status), HasSubstr("was not reached in 10 s, 24 spp"));
  status.relmse = 2e-3;
  EXPECT_THAT(target_note(status), HasSubstr("relMSE 0.002, whose interval"));
  status.relmse_high = 3e-3;
  EXPECT_THAT(target_note(status), HasSubstr("95 % sure below 0.003; about 20 s more would do"));
  EXPECT_EQ(target_met(status), false);
  status.relmse_high = 9e-4;
  EXPECT_EQ(target_note(status), "");
  EXPECT_EQ(target_met(status), true);
}

TEST(ProgressLine, SaysThatThePilotRuns) {
  JobStatus status;
  status.state = JobState::kRunning;
  status.settings.integrator = Integrator::kAuto;
  status.workers = 1;
  EXPECT_THAT(progress_line(status), HasSubstr("choosing strategies"));
  status.settings.plan = SamplingPlan{kEmissionHits | kNextEvent | kLightTracing, 0.5, 1};
  EXPECT_THAT(progress_line(status), Not(HasSubstr("choosing")));
  ::testing::internal::CaptureStderr();
  Progress progress(false);
  progress.update(status);
  progress.finish(status);
  const std::string text = ::testing::internal::GetCapturedStderr();
  EXPECT_THAT(text, HasSubstr("auto: hit,next-event,light-tracing × 0.5"));
  EXPECT_EQ(text.find("auto:"), text.rfind("auto:")) << "once";
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
