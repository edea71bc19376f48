// What an acknowledged commit survives: restarts, a crash after any write, a disk that fails at any write.
#include <gtest/gtest.h>

#include <filesystem>

#include "coordinator/store/memory_job_store.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;
using namespace testing;

LeaseKey key_of(const LeaseGrant& grant) { return {grant.job, grant.tile_id, grant.attempt}; }

TEST(Recovery, ARestartGoesOnWithTheSameTilesAndVoidsLeases) {
  const TemporaryFolder folder;
  const FakeClock clock;
  const JobRequest request = small_job(96, 96, 40);
  FarmOptions options = fake_options();
  options.checkpoint_bytes = 200e3;  // several snapshots on the way
  JobId job;
  std::optional<LeaseGrant> held;
  WorkerId before;
  LeaseGrant committed;
  {
    Farm farm(std::make_unique<SqliteJobStore>(folder.file("s")), clock, options);
    job = farm.submit(request);
    before = farm.register_worker(registration());
    work(farm, before, 7);
    committed = farm.lease(before).value();
    EXPECT_EQ(farm.commit(before, key_of(committed), fake_bytes(committed)), CommitResult::kAccepted);
    held = farm.lease(before);
    ASSERT_TRUE(held);
  }
  Farm farm(std::make_unique<SqliteJobStore>(folder.file("s")), clock, options);
  EXPECT_EQ(farm.job(job).tiles_committed, 8);
  EXPECT_EQ(farm.job(job).state, JobState::kRunning);
  EXPECT_FALSE(farm.curve(job).points.empty());
  EXPECT_THROW(farm.lease(before), UnknownWorker);
  EXPECT_EQ(farm.commit(before, key_of(*held), fake_bytes(*held)), CommitResult::kStale);
  EXPECT_EQ(farm.commit(before, key_of(committed), fake_bytes(committed)), CommitResult::kAlreadyCommitted)
      << "the acknowledgement may have been lost";
  const WorkerId after = farm.register_worker(registration());
  EXPECT_NE(after, before);
  const LeaseGrant again = farm.lease(after).value();
  EXPECT_EQ(again.tile_id, held->tile_id);
  EXPECT_EQ(again.tile, held->tile);
  EXPECT_EQ(again.attempt, 2);
  EXPECT_EQ(farm.commit(after, key_of(again), fake_bytes(again)), CommitResult::kAccepted);
  work(farm, after);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_EQ(farm.job(job).leases_reassigned, 1);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST(Recovery, ARestartKnowsTheErrorAtEveryScale) {
  const FakeClock clock;
  auto store = std::make_unique<MemoryJobStore>();
  JobRecord record;
  record.id = JobId{"j1"};
  record.state = JobState::kRunning;
  record.settings = small_settings(64, 64, 320);
  store->add_job(record, bundle_to_json(fake_bundle()), {});
  ErrorPoint point;
  point.spp = 64;
  point.relmse = 0.25;
  point.boxes = {BoxError{0.5, 0.25, 1, {}}, BoxError{0.75, {}, {}, {}}, BoxError{}};
  store->add_point(record.id, point);
  const Farm farm(std::move(store), clock, fake_options());
  EXPECT_EQ(farm.job(record.id).relmse, 0.25);
  EXPECT_EQ(farm.job(record.id).boxes, point.boxes);
  const auto metadata = farm.image_metadata(record.id);
  EXPECT_EQ(metadata.at("relmse_4"), "0.5");
  EXPECT_EQ(metadata.at("relmse_4_low"), "0.25");
  EXPECT_EQ(metadata.at("relmse_4_high"), "1");
  EXPECT_EQ(metadata.at("relmse_16"), "0.75");
  EXPECT_EQ(metadata.count("relmse_16_low") + metadata.count("relmse_32"), 0u);
}

TEST(Recovery, FinishedJobsSurviveAndCanBeExtended) {
  const TemporaryFolder folder;
  const FakeClock clock;
  JobId job;
  for (int64_t spp : {16, 24, 48}) {
    Farm farm(std::make_unique<SqliteJobStore>(folder.file("s")), clock, fake_options());
    if (spp == 16) {
      job = farm.submit(small_job(64, 64, spp));
    } else {
      EXPECT_EQ(farm.job(job).state, JobState::kDone);
      farm.extend(job, spp, {}, {});
    }
    work(farm, farm.register_worker(registration()));
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
    EXPECT_TRUE(same_pixels(farm.image(job), fake_image(small_settings(64, 64, spp))));
  }
}

class RecoveryOf : public ::testing::TestWithParam<Integrator> {};

TEST_P(RecoveryOf, ACrashBeforeAnyWriteLosesNothingThatWasAcknowledged) {
  const TemporaryFolder folder;
  const FakeClock clock;
  const JobRequest request = small_job(64, 32, 18, GetParam());
  FarmOptions options = fake_options();
  options.checkpoint_bytes = 60e3;
  SqliteJobStore store(folder.file("s"));
  int acknowledged = 0;
  std::vector<int> acknowledged_before;  // per copy
  const auto copy = [&](int write) {
    fs::create_directory(folder.file(std::to_string(write)));
    for (const char* suffix : {"", "-wal"}) {
      if (fs::exists(folder.file(std::string("s") + suffix))) {
        fs::copy(folder.file(std::string("s") + suffix), folder.file(std::to_string(write) + "/s" + suffix));
      }
    }
    acknowledged_before.push_back(acknowledged);
  };
  {
    Farm farm(std::make_unique<WatchedStore>(store, copy), clock, options);
    farm.submit(request);
    const WorkerId worker = farm.register_worker(registration());
    while (work(farm, worker, 1) == 1) ++acknowledged;
  }
  ASSERT_GT(acknowledged_before.size(), 30u);
  for (size_t i = 2; i < acknowledged_before.size(); ++i) {  // the job is there after the second write
    const std::string path = folder.file(std::to_string(i + 1) + "/s");
    Farm farm(std::make_unique<SqliteJobStore>(path), clock, options);
    ASSERT_EQ(farm.jobs().size(), 1u);
    const JobId job = farm.jobs()[0].id;
    const int pilot = farm.pilot(job) ? 1 : 0;
    EXPECT_GE(farm.job(job).tiles_committed + pilot, acknowledged_before[i]);
    EXPECT_EQ(farm.job(job).settings.plan.has_value(), pilot == 1);
    work(farm, farm.register_worker(registration()));
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
    EXPECT_EQ(farm.job(job).packets_done, farm.job(job).packets_total);
    ASSERT_TRUE(same_pixels(farm.image(job), fake_image(request.settings))) << "crash before write " << i + 1;
  }
}

TEST_P(RecoveryOf, ADiskThatFailsAtAnyWriteCostsARetryAndNothingElse) {
  const JobRequest request = small_job(64, 32, 18, GetParam());
  FarmOptions options = fake_options();
  options.checkpoint_bytes = 60e3;
  for (int failing = 1; failing < 60; ++failing) {
    FakeClock clock;
    MemoryJobStore store;
    Farm farm(std::make_unique<WatchedStore>(store,
                                             [&](int write) {
                                               if (write == failing) throw StoreError("disk full");
                                             }),
              clock, options);
    const auto retried = [&](auto&& action) {
      try {
        return action();
      } catch (const StoreError&) {
        clock.advance(1);
        farm.tick();  // finds the disk mended
        return action();
      }
    };
    const JobId job = retried([&] { return farm.submit(request); });
    const WorkerId worker = retried([&] { return farm.register_worker(registration()); });
    for (int turn = 0; turn < 1000 && farm.job(job).state != JobState::kDone; ++turn) {
      const auto grant = retried([&] { return farm.lease(worker); });
      if (!grant) {
        clock.advance(11);  // a lease whose write failed was never given
        retried([&] { return farm.tick(), 0; });
        continue;
      }
      const CommitResult result =
          retried([&] { return farm.commit(worker, key_of(*grant), fake_bytes(*grant)); });
      EXPECT_TRUE(result == CommitResult::kAccepted || result == CommitResult::kAlreadyCommitted);
    }
    EXPECT_EQ(farm.job(job).state, JobState::kDone) << "failing write " << failing;
    ASSERT_TRUE(same_pixels(farm.image(job), fake_image(request.settings))) << "failing write " << failing;
  }
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutPilot, RecoveryOf,
                         ::testing::Values(Integrator::kBdpt, Integrator::kAuto),
                         [](const auto& info) { return integrator_name(info.param); });

TEST(Recovery, ManyJobsAreNotAllKeptInMemory) {
  const FakeClock clock;
  Farm farm(std::make_unique<MemoryJobStore>(), clock, fake_options());
  const WorkerId worker = farm.register_worker(registration());
  std::vector<JobId> jobs;
  for (int i = 0; i < 12; ++i) jobs.push_back(farm.submit(small_job(40 + i, 40, 5)));
  work(farm, worker);
  for (int i = 0; i < 12; ++i) {
    EXPECT_TRUE(
        same_pixels(farm.image(jobs[static_cast<size_t>(i)]), fake_image(small_settings(40 + i, 40, 5))));
  }
}

}  // namespace
}  // namespace lightmill
