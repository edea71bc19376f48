// The farm as a state machine: leases, commits, states, stop rules. Time is simulated.
#include "coordinator/farm.h"

#include <algorithm>
#include <limits>
#include <thread>

#include "common/image/checkpoints.h"
#include "tests/coordinator/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

using FarmTest = FarmFixture;

TEST_F(FarmTest, RendersAJobAndGivesItsImage) {
  for (Integrator integrator : {Integrator::kBdpt, Integrator::kPt, Integrator::kLt}) {
    const JobRequest request = small_job(100, 70, 40, integrator);
    const JobId job = farm.submit(request);
    EXPECT_EQ(farm.job(job).state, JobState::kQueued);
    const WorkerId worker = farm.register_worker(registration());
    EXPECT_GT(work(farm, worker), 10);
    const JobStatus status = farm.job(job);
    EXPECT_EQ(status.state, JobState::kDone);
    EXPECT_EQ(status.packets_done, status.packets_total);
    EXPECT_EQ(status.packets_total, 4 * 3 * block_count(40));
    EXPECT_EQ(status.spp, 40);
    EXPECT_EQ(status.leases_reassigned, 0);
    EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
    for (const TileStatus& tile : farm.tiles(job)) {
      EXPECT_EQ(tile.state, "committed");
      EXPECT_EQ(tile.attempt, 1);
      EXPECT_EQ(tile.digest.size(), 64u);
    }
  }
}

TEST_F(FarmTest, AStoreNeedNotKeepLayersThatStayInMemory) {
  auto owned = std::make_unique<MemoryJobStore>(false);
  MemoryJobStore& store = *owned;
  FarmOptions options = fake_options();
  options.checkpoint_bytes = 10e3;
  Farm alone(std::move(owned), clock, options);
  const JobRequest request = small_job(100, 70, 40);
  const JobId job = alone.submit(request);
  EXPECT_GT(work(alone, alone.register_worker(registration())), 10);
  EXPECT_EQ(alone.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(alone.image(job), fake_image(request.settings)));
  EXPECT_TRUE(store.kept_partials(job).empty());
  EXPECT_TRUE(store.snapshot(job).film.empty());
}

TEST_F(FarmTest, OddSizesAndSampleCounts) {
  const WorkerId worker = farm.register_worker(registration());
  for (const auto& [width, height, spp] : {std::tuple{1, 1, 1}, {1, 2000, 3}, {33, 31, 17}, {64, 64, 50}}) {
    const JobRequest request = small_job(width, height, spp);
    const JobId job = farm.submit(request);
    work(farm, worker);
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
    EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings))) << width << "x" << height;
  }
  JobRequest cropped = small_job(300, 200, 20);
  cropped.settings.grid.crop = {45, 10, 201, 133};
  const JobId job = farm.submit(cropped);
  work(farm, worker);
  const Image image = farm.image(job);
  EXPECT_EQ(image.width, 201 - 45);
  EXPECT_TRUE(same_pixels(image, fake_image(cropped.settings)));
}

TEST_F(FarmTest, OrderOfCommitsDoesNotShow) {
  const JobRequest request = small_job(96, 96, 32);
  const JobId job = farm.submit(request);
  std::vector<WorkerId> workers;
  for (int i = 0; i < 3; ++i) workers.push_back(farm.register_worker(registration()));
  std::vector<std::pair<WorkerId, LeaseGrant>> held;
  for (int turn = 0;; ++turn) {
    const WorkerId& worker = workers[static_cast<size_t>(turn) % 3];
    if (const auto grant = farm.lease(worker)) held.emplace_back(worker, *grant);
    if (held.empty()) break;
    if (held.size() < 5 && turn % 7 != 0) continue;
    // The newest lease comes in first.
    EXPECT_EQ(commit(held.back().first, held.back().second), CommitResult::kAccepted);
    held.pop_back();
  }
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST_F(FarmTest, DuplicatesAndStaleAttemptsAreNotFolded) {
  const JobRequest request = small_job(64, 64, 4);
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration()), bob = farm.register_worker(registration());
  const LeaseGrant first = *farm.lease(ann);
  EXPECT_EQ(commit(ann, first), CommitResult::kAccepted);
  EXPECT_EQ(commit(ann, first), CommitResult::kAlreadyCommitted);
  EXPECT_EQ(commit(bob, first), CommitResult::kStale) << "not his lease";

  const LeaseGrant lost = *farm.lease(ann);
  clock.advance(10.5);
  const LeaseGrant again = *farm.lease(bob);
  EXPECT_EQ(again.tile_id, lost.tile_id);
  EXPECT_EQ(again.attempt, 2);
  EXPECT_EQ(commit(ann, lost), CommitResult::kStale);
  EXPECT_EQ(commit(bob, again), CommitResult::kAccepted);
  EXPECT_EQ(commit(ann, lost), CommitResult::kStale);
  EXPECT_EQ(farm.job(job).leases_reassigned, 1);
  work(farm, bob);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
  EXPECT_EQ(commit(bob, again), CommitResult::kAlreadyCommitted) << "also once the job is done";
  EXPECT_EQ(commit(ann, lost), CommitResult::kStale);
  EXPECT_EQ(farm.commit(ann, {JobId{"j99"}, TileId{0}, 1}, "x"), CommitResult::kUnknownJob);
  EXPECT_EQ(farm.commit(ann, {job, TileId{99999}, 1}, "x"), CommitResult::kUnknownJob);
}

TEST_F(FarmTest, RenewKeepsALeaseAndNamesTheLost) {
  farm.submit(small_job(64, 64, 4));
  const WorkerId ann = farm.register_worker(registration());
  const LeaseGrant grant = *farm.lease(ann);
  for (int i = 0; i < 5; ++i) {
    clock.advance(6);
    EXPECT_TRUE(farm.renew(ann, {key(grant)}).empty());
  }
  const LeaseKey wrong{grant.job, grant.tile_id, 7};
  EXPECT_EQ(farm.renew(ann, {key(grant), wrong}), (std::vector{wrong}));
  clock.advance(11);
  EXPECT_EQ(farm.renew(ann, {key(grant)}), (std::vector{key(grant)}));
  EXPECT_EQ(commit(ann, grant), CommitResult::kStale);
}

TEST_F(FarmTest, CorruptPartialsAreRefusedAndTheTileIsLeasedAgain) {
  const JobRequest request = small_job(64, 64, 4);
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration());
  const auto refused = [&](const std::function<std::string(const LeaseGrant&)>& bytes) {
    const WorkerId bob =
        farm.register_worker(registration());  // a new one each time: three such bench a worker
    const LeaseGrant grant = *farm.lease(bob);
    EXPECT_EQ(farm.commit(bob, key(grant), bytes(grant)), CommitResult::kCorrupt);
    EXPECT_EQ(farm.commit(bob, key(grant), fake_bytes(grant)), CommitResult::kStale) << "the lease is gone";
  };
  EXPECT_EQ(commit(ann, *farm.lease(ann)), CommitResult::kAccepted);
  refused([](const LeaseGrant&) { return std::string(); });
  refused([](const LeaseGrant& g) { return fake_bytes(g).substr(0, 50); });
  refused([](const LeaseGrant& g) {  // another tile's pixels
    TileSpec other = g.tile;
    other.sample_end += 1;
    return encode_partial(fake_partial(other, g.settings));
  });
  refused([](const LeaseGrant& g) {  // another film
    RenderSettings other = g.settings;
    other.grid = {65, 64, {0, 0, 65, 64}};
    return encode_partial(fake_partial(g.tile, other));
  });
  commit(ann, *farm.lease(ann));     // a good one in between, or the job would fail
  refused([](const LeaseGrant& g) {  // another plan
    Partial p = fake_partial(g.tile, g.settings);
    p.quantum_exponent += 1;
    return encode_partial(p);
  });
  refused([](const LeaseGrant& g) {  // a layer is missing
    Partial p = fake_partial(g.tile, g.settings);
    p.camera.clear();
    return encode_partial(p);
  });
  EXPECT_EQ(farm.stats().commits_corrupt, 6u);
  work(farm, ann);
  EXPECT_EQ(farm.job(job).leases_reassigned, 6);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST_F(FarmTest, ATileThatKeepsFailingFailsTheJobWithTheEvidence) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  const WorkerId ann = farm.register_worker(registration());
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(farm.job(job).state, i == 0 ? JobState::kQueued : JobState::kRunning);
    farm.fail(ann, key(*farm.lease(ann)), "texture wood.png vanished");
  }
  const JobStatus status = farm.job(job);
  EXPECT_EQ(status.state, JobState::kFailed);
  EXPECT_THAT(status.message, HasSubstr("tile 0"));
  EXPECT_THAT(status.message, HasSubstr("texture wood.png vanished"));
  EXPECT_FALSE(farm.lease(ann));
  farm.retry(job);
  EXPECT_EQ(farm.job(job).state, JobState::kRunning);
  EXPECT_EQ(farm.job(job).message, "");
  work(farm, ann);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(farm.job(job).settings)));
}

TEST_F(FarmTest, AFailedTileGoesToAnotherWorkerIfThereIsOne) {
  farm.submit(small_job(64, 64, 4));
  const WorkerId ann = farm.register_worker(registration()), bob = farm.register_worker(registration());
  const LeaseGrant failed = *farm.lease(ann);
  farm.fail(ann, key(failed), "no");
  EXPECT_NE(farm.lease(ann)->tile_id, failed.tile_id);
  EXPECT_EQ(farm.lease(bob)->tile_id, failed.tile_id);
}

TEST_F(FarmTest, AWorkerThatKeepsFailingIsBenchedAndForgiven) {
  for (int i = 0; i < 3; ++i) farm.submit(small_job(320, 320, 16));
  const WorkerId ann = farm.register_worker(registration()), bob = farm.register_worker(registration());
  for (int i = 0; i < 8; ++i) farm.fail(ann, key(*farm.lease(ann)), "bad memory");
  EXPECT_FALSE(farm.lease(ann));
  EXPECT_EQ(farm.workers()[0].state, "benched");
  EXPECT_TRUE(farm.lease(bob));
  clock.advance(31);
  EXPECT_TRUE(farm.lease(ann));
}

TEST_F(FarmTest, PauseResumeCancelRetry) {
  const JobRequest request = small_job(64, 64, 16);
  const JobId job = farm.submit(request);
  const WorkerId ann = farm.register_worker(registration());
  farm.pause(job);
  EXPECT_FALSE(farm.lease(ann));
  farm.resume(job);
  EXPECT_EQ(farm.job(job).state, JobState::kQueued);
  work(farm, ann, 3);
  const LeaseGrant in_flight = *farm.lease(ann);
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
  const LeaseGrant doomed = *farm.lease(ann);
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

TEST_F(FarmTest, ExtendedIsTheSameAsFresh) {
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

TEST_F(FarmTest, TimeLimitStopsTheJobAndExtendGoesOn) {
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

TEST_F(FarmTest, ATimeThatIsTooShortStillGivesAWholePicture) {
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

TEST_F(FarmTest, TargetErrorStopsAtTheFirstCheckpointThatMeetsIt) {
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

TEST_F(FarmTest, NobodyRunsAheadOfACheckpointThatMayBeTheLast) {
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

TEST_F(FarmTest, PoolsAndArithmeticClasses) {
  JobRequest request = small_job(64, 64, 4);
  request.pool = "gpu";
  const JobId job = farm.submit(request);
  EXPECT_THAT(farm.job(job).message, HasSubstr("none is connected"));
  const WorkerId plain = farm.register_worker(registration());
  EXPECT_FALSE(farm.lease(plain));
  EXPECT_THAT(farm.job(job).message, HasSubstr("pool \"gpu\""));
  const WorkerId a = farm.register_worker(registration("class-a", "gpu"));
  const WorkerId b = farm.register_worker(registration("class-b", "gpu"));
  EXPECT_EQ(commit(a, *farm.lease(a)), CommitResult::kAccepted);
  EXPECT_FALSE(farm.lease(b)) << "the job belongs to the class of its first worker";
  farm.drain(a);
  EXPECT_FALSE(farm.lease(a));
  EXPECT_THAT(farm.job(job).message, HasSubstr("arithmetic class class-a"));
  const JobId other = farm.submit(small_job(64, 64, 4));
  EXPECT_EQ(farm.lease(b)->job, other) << "it takes other jobs";
}

TEST_F(FarmTest, WorkersOfAnotherBuildOrSchemaAreRefusedWithASentence) {
  WorkerRegistration other = registration();
  other.build = "build-2";
  EXPECT_THAT(error_of([&] { farm.register_worker(other); }), HasSubstr("another build"));
  other = registration();
  other.schema = 7;
  EXPECT_THAT(error_of([&] { farm.register_worker(other); }), HasSubstr("another schema"));
  EXPECT_THAT(error_of([&] { farm.lease(WorkerId{"w77"}); }), HasSubstr("register again"));
  const auto workers = farm.workers();
  ASSERT_EQ(workers.size(), 2u);
  EXPECT_EQ(workers[0].state, "refused");
}

TEST_F(FarmTest, WorkersAreLostAfterThreeLeaseTimes) {
  const WorkerId ann = farm.register_worker(registration());
  clock.advance(29);
  EXPECT_EQ(farm.workers()[0].state, "idle");
  clock.advance(2);
  EXPECT_EQ(farm.workers()[0].state, "lost");
  EXPECT_FALSE(farm.lease(ann));
  EXPECT_EQ(farm.workers()[0].state, "idle") << "it has come back";
}

TEST_F(FarmTest, CurveHasGeometricPointsAndTrueErrors) {
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
  JobRequest wrong = small_job(32, 64, 320);
  wrong.reference = request.reference;
  EXPECT_THAT(error_of([&] { farm.submit(wrong); }), HasSubstr("reference"));
  request.reference.data[3 * 65 + 1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(error_of([&] { farm.submit(request); }),
              HasSubstr("the reference has a non-finite value at pixel (1, 1)"));
}

TEST_F(FarmTest, SettingsOutOfRangeAreRefused) {
  JobRequest request = small_job(64, 64, 0);
  EXPECT_THROW(farm.submit(request), Error);
  request = small_job(0, 64, 1);
  EXPECT_THROW(farm.submit(request), Error);
}

TEST_F(FarmTest, WaitReturnsOnChangeAndOnTimeout) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  const uint64_t version = farm.job(job).version;
  EXPECT_EQ(farm.wait(job, version, 0.01).version, version);
  std::thread changer([&] { farm.pause(job); });
  EXPECT_EQ(farm.wait(job, version, 60).state, JobState::kPaused);
  changer.join();
}

TEST_F(FarmTest, ALongPollWakesUpForAJobAndForShutdown) {
  const WorkerId ann = farm.register_worker(registration());
  std::thread submitter([&] { farm.submit(small_job(64, 64, 1)); });
  EXPECT_TRUE(farm.lease(ann, 60));
  submitter.join();
  const WorkerId bob = farm.register_worker(registration("class-b"));
  std::thread stopper([&] { farm.stop_waiting(); });
  EXPECT_FALSE(farm.lease(bob, 60));
  stopper.join();
}

TEST(FarmLimits, NoMoreWorkersThanAskedForUntilSomeAreLost) {
  FakeClock clock;
  FarmOptions options = fake_options();
  options.max_workers = 2;
  Farm farm(std::make_unique<MemoryJobStore>(), clock, options);
  farm.register_worker(registration());
  farm.register_worker(registration());
  try {
    farm.register_worker(registration());
    FAIL() << "a third worker";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("--max-workers"));
  }
  clock.advance(1000);
  EXPECT_NO_THROW(farm.register_worker(registration())) << "those before are lost";
}

TEST(FarmLimits, AThousandWorkersEndAJobTogether) {
  FakeClock clock;
  FarmOptions options = fake_options();
  Farm farm(std::make_unique<MemoryJobStore>(), clock, options);
  const JobRequest request = small_job(128, 128, 64);
  const JobId job = farm.submit(request);
  std::vector<WorkerId> workers;
  for (int i = 0; i < 1200; ++i) workers.push_back(farm.register_worker(registration()));
  // All ask at once, then all commit; at the end there are many more workers than tiles to have.
  for (int turn = 0; turn < 200 && farm.job(job).state != JobState::kDone; ++turn) {
    std::vector<std::pair<WorkerId, LeaseGrant>> held;
    for (const WorkerId& worker : workers) {
      if (const auto grant = farm.lease(worker)) held.emplace_back(worker, *grant);
    }
    clock.advance(0.5);
    for (const auto& [worker, grant] : held) {
      farm.commit(worker, {grant.job, grant.tile_id, grant.attempt}, fake_bytes(grant));
    }
  }
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST_F(FarmTest, ManyWorkersAtOnce) {
  const JobRequest request = small_job(128, 96, 64);
  const JobId job = farm.submit(request);
  std::vector<std::thread> threads;
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&] {
      const WorkerId worker = farm.register_worker(registration());
      while (!is_final(farm.job(job).state)) {
        const auto grant = farm.lease(worker, 0.05);
        if (!grant) continue;
        EXPECT_EQ(commit(worker, *grant), CommitResult::kAccepted);
        farm.image(job);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

}  // namespace
}  // namespace lightmill
