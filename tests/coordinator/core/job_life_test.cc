// A job from its first tile to its last: stop rules, what users do to it, and who waits for it. Time is
// simulated.
#include <algorithm>
#include <limits>
#include <thread>

#include "common/error/checkpoints.h"
#include "common/error/metrics.h"
#include "coordinator/core/farm.h"
#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

using JobLife = FarmFixture;

TEST_F(JobLife, PauseResumeCancelRetry) {
  const JobRequest request = small_job(64, 64, 16);
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration());
  farm.pause(job);
  EXPECT_FALSE(farm.lease(ann));
  farm.resume(job);
  EXPECT_EQ(farm.job(job).state, JobState::kQueued);
  work(farm, ann, 3);
  const LeaseGrant in_flight = farm.lease(ann).value();
  clock.advance(2);
  farm.pause(job);
  EXPECT_EQ(farm.job(job).state, JobState::kPaused);
  EXPECT_FALSE(farm.lease(ann));
  EXPECT_EQ(commit(ann, in_flight), CommitResult::kAccepted) << "leases in flight may still commit";
  clock.advance(100);
  EXPECT_NEAR(farm.job(job).wall_seconds, 2, 1e-9);
  EXPECT_THAT(error_of([&] { farm.pause(job); }), HasSubstr("is paused"));
  farm.resume(job);
  EXPECT_THAT(error_of([&] { farm.resume(job); }), HasSubstr("is running"));
  EXPECT_THAT(error_of([&] { farm.retry(job); }), HasSubstr("failed or cancelled"));
  const LeaseGrant doomed = farm.lease(ann).value();
  farm.cancel(job);
  EXPECT_EQ(commit(ann, doomed), CommitResult::kUnknownJob);
  EXPECT_EQ(farm.renew(ann, {key(doomed)}).size(), 1u);
  EXPECT_FALSE(farm.lease(ann));
  EXPECT_GT(farm.image(job).pixel(0, 0)[0], 0) << "what was merged stays";
  EXPECT_THAT(error_of([&] { farm.cancel(job); }), HasSubstr("is cancelled"));
  EXPECT_THAT(error_of([&] { farm.extend(job, 100, {}, {}); }), HasSubstr("retry"));
  farm.retry(job);
  work(farm, ann);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
  EXPECT_THAT(error_of([&] { farm.job(JobId{"j99"}); }), HasSubstr("no job \"j99\""));
}

TEST_F(JobLife, ExtendedIsTheSameAsFresh) {
  const WorkerId ann = farm.register_worker(registration());
  for (const auto& [first, total] : {std::pair{40, 80}, {32, 64}, {1, 7}}) {
    const JobId job = farm.submit(small_job(96, 40, first));
    work(farm, ann);
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
    farm.extend(job, total, {}, {});
    EXPECT_EQ(farm.job(job).state, JobState::kRunning);
    EXPECT_LT(farm.job(job).packets_done, farm.job(job).packets_total);
    work(farm, ann);
    const JobStatus status = farm.job(job);
    EXPECT_EQ(status.state, JobState::kDone);
    EXPECT_EQ(status.packets_done, status.packets_total);
    EXPECT_EQ(status.packets_done, 6 * block_count(total));
    EXPECT_TRUE(same_pixels(farm.image(job), fake_image(small_settings(96, 40, total))));
    EXPECT_THAT(error_of([&, first = first] { farm.extend(job, first, {}, {}); }), HasSubstr("new total"));
    EXPECT_THAT(error_of([&] { farm.extend(job, -1, {}, {}); }), HasSubstr("samples"));
    farm.extend(job, total, {}, {});
    EXPECT_EQ(farm.job(job).state, JobState::kDone) << "nothing to do";
  }
}

TEST_F(JobLife, TimeLimitStopsTheJobAndExtendGoesOn) {
  JobRequest request = small_job(64, 64, 100000);
  request.settings.time_s = 20;
  const JobId job = farm.submit(request);
  clock.advance(1000);  // waiting for a worker does not count
  const WorkerId ann = farm.register_worker(registration());
  for (int i = 0; i < 1000; ++i) {
    const auto grant = farm.lease(ann);
    if (!grant) break;
    clock.advance(0.5);
    EXPECT_EQ(farm.commit(ann, key(*grant), fake_bytes(*grant, 1.0)), CommitResult::kAccepted);
  }
  JobStatus status = farm.job(job);
  EXPECT_EQ(status.state, JobState::kDone);
  EXPECT_GT(status.wall_seconds, 15);
  EXPECT_LT(status.wall_seconds, 21);
  EXPECT_EQ(status.packets_done, status.packets_total);
  EXPECT_GT(status.spp, 10);
  farm.extend(job, {}, 40, {});
  status = farm.job(job);
  EXPECT_EQ(status.state, JobState::kRunning);
  EXPECT_TRUE(farm.lease(ann));
}

TEST_F(JobLife, ATimeThatIsTooShortStillGivesAWholePicture) {
  JobRequest request = small_job(320, 320, 1000);
  request.settings.time_s = 0.5;
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration());
  while (const auto grant = farm.lease(ann)) {
    clock.advance(1);
    EXPECT_EQ(commit(ann, *grant), CommitResult::kAccepted);
  }
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(small_settings(320, 320, 1))));
}

TEST_F(JobLife, TargetErrorStopsAtTheFirstCheckpointThatMeetsIt) {
  JobRequest request = small_job(64, 64, 100000);
  request.settings.target_error = 0.01;
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration());
  work(farm, ann);
  const JobStatus status = farm.job(job);
  EXPECT_EQ(status.state, JobState::kDone);
  ASSERT_TRUE(status.relmse_high);
  EXPECT_LT(*status.relmse_high, 0.01);
  int64_t checkpoint = 0;
  size_t points = 0;
  for (const ErrorPoint& p : farm.curve(job).points) {
    checkpoint = next_checkpoint(checkpoint);
    ++points;
    EXPECT_EQ(p.spp, static_cast<double>(checkpoint)) << "one worker: nothing runs ahead";
    EXPECT_EQ(meets_target(p, 0.01), p.spp == status.spp);
  }
  EXPECT_GT(points, 6u);
  auto settings = request.settings;
  settings.spp = static_cast<int64_t>(status.spp);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(settings)))
      << "repeating with the record repeats the bytes";
}

TEST_F(JobLife, NobodyRunsAheadOfACheckpointThatMayBeTheLast) {
  JobRequest request = small_job(128, 64, 100000);
  request.settings.target_error = 1e-3;
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration()), ben = farm.register_worker(registration());
  double idle_low = 1, busy_low = 0;
  while (farm.job(job).state != JobState::kDone) {
    auto first = farm.lease(ann);
    ASSERT_TRUE(first);
    std::optional<LeaseGrant> last;
    while (auto more = farm.lease(ben)) {
      if (more->tile.sample_begin > first->tile.sample_begin) {
        last = more;
        break;
      }
      EXPECT_EQ(commit(ben, *more), CommitResult::kAccepted);
    }
    // Ben has nothing to do while Ann renders the last tile: or he is ahead, as the target is out of sight.
    const JobStatus status = farm.job(job);
    if (first->tile.sample_end >= 64 &&
        next_checkpoint(first->tile.sample_end - 1) == first->tile.sample_end && status.relmse_low) {
      const double low = *status.relmse_low;
      if (last) busy_low = std::max(busy_low, 1e-3 / low);
      if (!last) idle_low = std::min(idle_low, 1e-3 / low);
    }
    EXPECT_EQ(commit(ann, *first), CommitResult::kAccepted);
    if (last) {
      EXPECT_EQ(commit(ben, *last), CommitResult::kAccepted);
    }
  }
  EXPECT_LT(*farm.job(job).relmse_high, 1e-3);
  EXPECT_GT(busy_low, 0);
  EXPECT_GT(idle_low, 0.5);
}

TEST_F(JobLife, CurveHasGeometricPointsAndTrueErrors) {
  JobRequest request = small_job(64, 64, 320);
  request.reference = fake_image(small_settings(64, 64, 2000));
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration());
  while (const auto grant = farm.lease(ann)) {
    clock.advance(0.25);
    EXPECT_EQ(commit(ann, *grant), CommitResult::kAccepted);
  }
  const ErrorCurve curve = farm.curve(job);
  ASSERT_GE(curve.points.size(), 8u);
  EXPECT_EQ(curve.points.back().spp, 320);
  for (size_t i = 1; i < curve.points.size(); ++i) {
    EXPECT_GT(curve.points[i].spp, curve.points[i - 1].spp);
    EXPECT_GT(curve.points[i].wall_seconds, curve.points[i - 1].wall_seconds);
  }
  const ErrorPoint& last = curve.points.back();
  ASSERT_TRUE(last.relmse && last.true_relmse && last.true_flip);
  EXPECT_EQ(last.batches, 20);
  EXPECT_NEAR(*last.true_relmse / *last.relmse, 1.0, 0.4);
  EXPECT_LT(*last.true_relmse, *curve.points[0].true_relmse);
  const Metrics metrics = compare_images(farm.image(job), request.reference);
  for (size_t i = 0; i < kBoxSides.size(); ++i) {
    ASSERT_TRUE(last.boxes[i].true_relmse);
    EXPECT_EQ(last.boxes[i].true_relmse, metrics.relmse_of_boxes[i]);
  }
  EXPECT_EQ(farm.job(job).boxes, last.boxes);
  JobRequest wrong = small_job(32, 64, 320);
  wrong.reference = request.reference;
  EXPECT_THAT(error_of([&] { farm.submit(wrong); }), HasSubstr("reference"));
  request.reference.data[3 * 65 + 1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(error_of([&] { farm.submit(request); }),
              HasSubstr("the reference has a non-finite value at pixel (1, 1)"));
}

TEST_F(JobLife, SettingsOutOfRangeAreRefused) {
  JobRequest request = small_job(64, 64, 0);
  EXPECT_THROW(farm.submit(request), Error);
  request = small_job(0, 64, 1);
  EXPECT_THROW(farm.submit(request), Error);
}

TEST_F(JobLife, WaitReturnsOnChangeAndOnTimeout) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  const uint64_t version = farm.job(job).version;
  EXPECT_EQ(farm.wait(job, version, 0.01).version, version);
  std::thread changer([&] { farm.pause(job); });
  EXPECT_EQ(farm.wait(job, version, 60).state, JobState::kPaused);
  changer.join();
}

TEST_F(JobLife, ALongPollWakesUpForAJobAndForShutdown) {
  const WorkerId ann = farm.register_worker(registration());
  std::thread submitter([&] { farm.submit(small_job(64, 64, 1)); });
  EXPECT_TRUE(farm.lease(ann, 60));
  submitter.join();
  const WorkerId bob = farm.register_worker(registration("class-b"));
  std::thread stopper([&] { farm.stop_waiting(); });
  EXPECT_FALSE(farm.lease(bob, 60));
  stopper.join();
}

TEST_F(JobLife, NamesCommandNoTerminalAndReadAsNothingElse) {
  JobRequest request = small_job(32, 32, 1);
  request.name = "a\x1b[2Jb\nc";
  request.pool = "caf\xe9";
  request.submitter = "\u202eann";
  const JobStatus job = farm.job(farm.submit(request));
  EXPECT_EQ(job.name, "a [2Jb");
  EXPECT_EQ(job.pool, "caf\ufffd");
  EXPECT_EQ(job.submitter, "\ufffdann");
}

}  // namespace
}  // namespace lightmill
