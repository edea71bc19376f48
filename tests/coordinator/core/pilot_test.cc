// A job with the integrator auto: one pilot is leased before any tile, and what it chose is the job's plan.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "coordinator/core/farm.h"
#include "coordinator/store/memory_job_store.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

LeaseKey key(const LeaseGrant& grant) { return {grant.job, grant.tile_id, grant.attempt}; }

class PilotTest : public ::testing::Test {
 protected:
  PilotTest()
      : farm(std::make_unique<MemoryJobStore>(), clock, fake_options()),
        ann(farm.register_worker(registration())),
        bob(farm.register_worker(registration())) {}
  CommitResult commit(const WorkerId& worker, const LeaseGrant& grant) {
    return farm.commit(worker, key(grant), fake_bytes(grant));
  }
  FakeClock clock;
  Farm farm;
  WorkerId ann, bob;
  const JobRequest request = small_job(64, 64, 20, Integrator::kAuto);
};

TEST_F(PilotTest, IsLeasedFirstAndAlone) {
  const JobId job = farm.submit(request);
  EXPECT_FALSE(farm.pilot(job));
  const LeaseGrant pilot = farm.lease(ann).value();
  EXPECT_TRUE(is_pilot(pilot.tile));
  EXPECT_TRUE(needs_pilot(pilot.settings));
  EXPECT_EQ(farm.job(job).message, "choosing strategies");
  EXPECT_EQ(farm.job(job).state, JobState::kRunning);
  EXPECT_FALSE(farm.lease(bob)) << "no tile before the pilot's commit";
  ASSERT_EQ(farm.tiles(job).size(), 1u);
  EXPECT_EQ(farm.tiles(job)[0].state, "leased");

  clock.advance(3);
  EXPECT_EQ(farm.commit(ann, key(pilot), encode_pilot({fake_pilot(), 2.5})), CommitResult::kAccepted);
  EXPECT_EQ(commit(ann, pilot), CommitResult::kAlreadyCommitted);
  const JobStatus status = farm.job(job);
  EXPECT_EQ(status.settings.plan, fake_pilot().chosen);
  EXPECT_EQ(status.cpu_seconds, 2.5);
  EXPECT_EQ(status.wall_seconds, 3) << "choosing is part of rendering";
  EXPECT_EQ(status.tiles_committed, 0);
  EXPECT_EQ(status.packets_done, 0);
  EXPECT_EQ(status.message, "");
  EXPECT_EQ(pilot_to_json(*farm.pilot(job)), pilot_to_json(fake_pilot()));
  EXPECT_EQ(farm.image_metadata(job).at("plan"), plan_to_json(fake_pilot().chosen));

  const LeaseGrant tile = farm.lease(bob).value();
  EXPECT_FALSE(is_pilot(tile.tile));
  EXPECT_EQ(tile.settings.plan, fake_pilot().chosen);
  EXPECT_EQ(commit(bob, tile), CommitResult::kAccepted);
  work(farm, ann);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_EQ(farm.job(job).packets_done, farm.job(job).packets_total);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
  EXPECT_EQ(commit(ann, pilot), CommitResult::kAlreadyCommitted) << "also once the job is done";
}

TEST_F(PilotTest, TellsTheJobWhatLightItsImageLacks) {
  const JobId job = farm.submit(request);
  const LeaseGrant pilot = farm.lease(ann).value();
  PilotReport report = fake_pilot();
  report.missing_light = {"about a tenth"};
  EXPECT_EQ(farm.commit(ann, key(pilot), encode_pilot({report, 1})), CommitResult::kAccepted);
  EXPECT_EQ(farm.job(job).missing_light, report.missing_light);
}

TEST_F(PilotTest, APictureOfItsWorkerIsShownUntilThereAreSamples) {
  const JobId job = farm.submit(request);
  const LeaseGrant pilot = farm.lease(ann).value();
  const uint64_t version = farm.job(job).version;
  Image look(2, 1);
  look.data = {1, 2, 3, 4, 5, 6};
  farm.show(bob, key(pilot), look);
  EXPECT_EQ(farm.job(job).version, version) << "the lease is another's";
  farm.show(ann, key(pilot), look);
  EXPECT_GT(farm.job(job).version, version) << "those who watch are to look";
  Image shown = farm.display_image(job);
  ASSERT_EQ(shown.width, 64);
  ASSERT_EQ(shown.height, 64);
  EXPECT_EQ(shown.pixel(31, 63)[1], 2);
  EXPECT_EQ(shown.pixel(32, 0)[2], 6);
  EXPECT_EQ(farm.image(job).pixel(0, 0)[0], 0) << "it is no part of the image";

  EXPECT_EQ(commit(ann, pilot), CommitResult::kAccepted);
  EXPECT_EQ(farm.display_image(job).pixel(0, 0)[0], 1);
  const LeaseGrant tile = farm.lease(ann).value();
  farm.show(ann, key(tile), Image(5, 5));
  EXPECT_EQ(farm.display_image(job).pixel(0, 0)[0], 1) << "only a pilot's worker shows one";
  EXPECT_EQ(commit(ann, tile), CommitResult::kAccepted);
  work(farm, ann);
  EXPECT_TRUE(same_pixels(farm.display_image(job), farm.image(job)));
}

TEST_F(PilotTest, PicturesOfAnotherSizeAreRefused) {
  const JobId job = farm.submit(request);
  const LeaseGrant pilot = farm.lease(ann).value();
  Image unreal(1, 1), empty, torn(2, 2);
  unreal.data[1] = std::numeric_limits<float>::infinity();
  torn.data.pop_back();
  for (const Image& picture : {Image(257, 1), Image(1, 257), Image(2, 2, 4), unreal, empty, torn})
    EXPECT_THROW(farm.show(ann, key(pilot), picture), Error);
  EXPECT_EQ(farm.display_image(job).pixel(0, 0)[0], 0);
}

TEST_F(PilotTest, AFixedIntegratorOrAPlanNeedsNone) {
  JobRequest planned = request;
  planned.settings.plan = SamplingPlan{kAllStrategies, 0.5, 2};
  for (const JobRequest& r : {small_job(64, 64, 4, Integrator::kPt), planned}) {
    const JobId job = farm.submit(r);
    EXPECT_FALSE(is_pilot(farm.lease(ann).value().tile));
    EXPECT_FALSE(farm.pilot(job));
    farm.cancel(job);
  }
}

TEST_F(PilotTest, ItsLeaseIsRenewedLostAndGivenToAnother) {
  const JobId job = farm.submit(request);
  const LeaseGrant lost = farm.lease(ann).value();
  for (int i = 0; i < 5; ++i) {
    clock.advance(6);
    EXPECT_TRUE(farm.renew(ann, {key(lost)}).empty());
  }
  clock.advance(10.5);
  const LeaseGrant again = farm.lease(bob).value();
  EXPECT_TRUE(is_pilot(again.tile));
  EXPECT_EQ(again.attempt, 2);
  EXPECT_EQ(farm.renew(ann, {key(lost)}), (std::vector{key(lost)}));
  EXPECT_EQ(commit(ann, lost), CommitResult::kStale);
  EXPECT_FALSE(farm.pilot(job)) << "a stale attempt decides nothing";
  EXPECT_TRUE(needs_pilot(farm.job(job).settings));
  EXPECT_EQ(commit(bob, again), CommitResult::kAccepted);
  EXPECT_EQ(commit(ann, lost), CommitResult::kStale);
  EXPECT_EQ(farm.job(job).leases_reassigned, 1);
  work(farm, ann);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST_F(PilotTest, AHostileResultIsRefusedAndTheLeaseGone) {
  const JobId job = farm.submit(request);
  const std::string good = encode_pilot({fake_pilot(), 1});
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  const std::string hostile[] = {
      "",
      "{",
      good.substr(0, good.size() / 2),
      with("\"cpu_seconds\":1.0", "\"cpu_seconds\":-1"),
      with("\"cpu_seconds\":1.0", "\"cpu_seconds\":1e300"),
      with("\"cpu_seconds\":1.0", "\"cpu_seconds\":\"1\""),
      with("hit,next-event", "hit,magic"),
      with("\"light_paths\":1.0", "\"light_paths\":1e9"),
      with("\"samples\":1000", "\"samples\":-1"),
      with("\"needed\":true", "\"needed\":1"),
      with("one <lamp>", std::string(3000, 'x')),
      good + std::string(kMaxPilotResultBytes, ' '),
      "{\"cpu_seconds\":1,\"report\":" + std::string(500000, '['),
      "{\"cpu_seconds\":1,\"report\":" + std::string(500000, '[') + std::string(500000, ']') + "}",
      fake_bytes({job, TileId{0}, 1, {{0, 0, 1, 1}, 0, 1}, after_pilot(request.settings), "", 10}),
  };
  for (const std::string& bytes : hostile) {
    // A new worker each time, and a retry when the job has had enough: one alone would be benched.
    const WorkerId worker = farm.register_worker(registration());
    if (farm.job(job).state == JobState::kFailed) farm.retry(job);
    const LeaseGrant pilot = farm.lease(worker).value();
    ASSERT_TRUE(is_pilot(pilot.tile));
    EXPECT_EQ(farm.commit(worker, key(pilot), bytes), CommitResult::kCorrupt) << bytes.substr(0, 80);
    EXPECT_EQ(commit(worker, pilot), CommitResult::kStale) << "the lease is gone";
    EXPECT_FALSE(farm.pilot(job));
  }
  EXPECT_EQ(farm.stats().commits_corrupt, std::size(hostile));
  if (farm.job(job).state == JobState::kFailed) farm.retry(job);
  work(farm, ann);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST_F(PilotTest, KeepsFailingFailsTheJobWhichCanBeRetried) {
  const JobId job = farm.submit(request);
  for (int i = 0; i < 5; ++i) {
    const WorkerId& worker = i % 2 == 0 ? ann : bob;
    farm.fail(worker, key(farm.lease(worker).value()), "out of memory");
  }
  EXPECT_EQ(farm.job(job).state, JobState::kFailed);
  EXPECT_THAT(farm.job(job).message, HasSubstr("the pilot failed 5 times"));
  EXPECT_THAT(farm.job(job).message, HasSubstr("out of memory"));
  farm.retry(job);
  work(farm, ann);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
}

TEST_F(PilotTest, PausedAndCancelledJobsStartNone) {
  const JobId job = farm.submit(request);
  farm.pause(job);
  EXPECT_FALSE(farm.lease(ann));
  farm.resume(job);
  const LeaseGrant pilot = farm.lease(ann).value();
  farm.pause(job);
  EXPECT_EQ(commit(ann, pilot), CommitResult::kAccepted) << "a lease in flight may still commit";
  EXPECT_FALSE(farm.lease(ann));
  farm.resume(job);
  EXPECT_FALSE(is_pilot(farm.lease(ann).value().tile));
  const JobId other = farm.submit(request);
  farm.cancel(job);
  const LeaseGrant second = farm.lease(bob).value();
  EXPECT_EQ(second.job, other);
  farm.cancel(other);
  EXPECT_EQ(commit(bob, second), CommitResult::kUnknownJob);
}

TEST_F(PilotTest, ExtendKeepsThePlan) {
  const JobId job = farm.submit(request);
  farm.extend(job, 32, {}, {});  // before there is a plan
  work(farm, ann);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  farm.extend(job, 64, {}, {});
  EXPECT_EQ(farm.job(job).settings.plan, fake_pilot().chosen);
  EXPECT_FALSE(is_pilot(farm.lease(bob).value().tile));
  clock.advance(11);
  work(farm, ann);
  JobRequest fresh = request;
  fresh.settings.spp = 64;
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(fresh.settings)));
  EXPECT_EQ(farm.stats().commits, farm.tiles(job).size()) << "one pilot, and every tile once";
}

TEST_F(PilotTest, ATimeThatThePilotUsedUpStillGivesAPicture) {
  JobRequest timed = request;
  timed.settings.time_s = 2;
  timed.settings.spp = 1000;
  const JobId job = farm.submit(timed);
  const LeaseGrant pilot = farm.lease(ann).value();
  clock.advance(5);
  EXPECT_EQ(commit(ann, pilot), CommitResult::kAccepted);
  EXPECT_EQ(farm.job(job).state, JobState::kRunning);
  work(farm, ann);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_EQ(farm.job(job).spp, 1);
  EXPECT_EQ(farm.job(job).wall_seconds, 5);
}

TEST_F(PilotTest, WhatItLeftOutIsRefused) {
  farm.submit(request);
  work(farm, ann, 1);
  const LeaseGrant tile = farm.lease(ann).value();
  RenderSettings all = tile.settings;
  all.plan = SamplingPlan();
  EXPECT_EQ(farm.commit(ann, key(tile), encode_partial(fake_partial(tile.tile, all))),
            CommitResult::kCorrupt);
  const Partial partial = fake_partial(tile.tile, tile.settings);
  EXPECT_TRUE(partial.splats.empty());
  EXPECT_EQ(partial.light_paths, 0u);
}

TEST(PilotRecovery, ARestartBeforeAndAfterTheCommit) {
  const TemporaryFolder folder;
  const FakeClock clock;
  const auto open = [&] { return std::make_unique<SqliteJobStore>(folder.file("s")); };
  JobId job;
  WorkerId before;
  LeaseGrant held;
  {
    Farm farm(open(), clock, fake_options());
    job = farm.submit(small_job(64, 64, 20, Integrator::kAuto));
  }
  {
    Farm farm(open(), clock, fake_options());
    before = farm.register_worker(registration());
    held = farm.lease(before).value();
    EXPECT_TRUE(is_pilot(held.tile));
  }
  LeaseGrant again;
  WorkerId after;
  {
    Farm farm(open(), clock, fake_options());
    EXPECT_EQ(farm.commit(before, key(held), fake_bytes(held)), CommitResult::kStale) << "leases are void";
    after = farm.register_worker(registration());
    again = farm.lease(after).value();
    EXPECT_TRUE(is_pilot(again.tile));
    EXPECT_EQ(again.attempt, 2);
    EXPECT_EQ(farm.commit(after, key(again), fake_bytes(again)), CommitResult::kAccepted);
  }
  Farm farm(open(), clock, fake_options());
  EXPECT_EQ(farm.job(job).settings.plan, fake_pilot().chosen);
  EXPECT_EQ(pilot_to_json(*farm.pilot(job)), pilot_to_json(fake_pilot()));
  EXPECT_EQ(farm.commit(after, key(again), fake_bytes(again)), CommitResult::kAlreadyCommitted);
  EXPECT_EQ(farm.commit(before, key(held), fake_bytes(held)), CommitResult::kStale);
  work(farm, farm.register_worker(registration()));
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(farm.job(job).settings)));
}

}  // namespace
}  // namespace lightmill
