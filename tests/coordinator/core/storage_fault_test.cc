// A disk that fails for a while, or holds what it should not: jobs pause with the reason, and go on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "coordinator/merge/merger.h"
#include "coordinator/merge/store_check.h"
#include "coordinator/store/memory_job_store.h"
#include "coordinator/store/sqlite/sqlite_db.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "coordinator/store/storage_health.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

LeaseKey key(const LeaseGrant& grant) { return {grant.job, grant.tile_id, grant.attempt}; }

class StorageFault : public ::testing::Test {
 protected:
  StorageFault()
      : farm(std::make_unique<WatchedStore>(store,
                                            [this](int) {
                                              if (broken) throw StoreError("jobs.sqlite: disk full");
                                            }),
             clock, fake_options()) {
    job = farm.submit(request);
    worker = farm.register_worker(registration());
  }
  void pass(double seconds) {
    clock.advance(seconds);
    farm.tick();
  }
  bool broken = false;
  FakeClock clock;
  MemoryJobStore store;
  JobRequest request = small_job(96, 96, 40);
  Farm farm;
  JobId job;
  WorkerId worker;
};

TEST(Registration, TheDiskIsWaitedForWithoutTheFarm) {
  FakeClock clock;
  MemoryJobStore store;
  const Farm* asked = nullptr;
  int writes = 0;
  const auto while_writing = [&](int) {
    if (!asked) return;
    ++writes;
    EXPECT_EQ(asked->job_count(), 0u);  // if the farm were locked meanwhile, this would never return
  };
  Farm farm(std::make_unique<WatchedStore>(store, while_writing), clock, fake_options());
  asked = &farm;
  farm.register_worker(registration());
  EXPECT_EQ(writes, 2) << "its number, and the sync";
}

TEST_F(StorageFault, PausesTheJobWithTheReasonAndGoesOnByItself) {
  work(farm, worker, 3);
  const LeaseGrant held = farm.lease(worker).value();
  broken = true;
  EXPECT_THROW(farm.commit(worker, key(held), fake_bytes(held)), StoreError);
  pass(0);
  EXPECT_EQ(farm.job(job).state, JobState::kPaused);
  EXPECT_THAT(farm.job(job).message, HasSubstr("disk full"));
  EXPECT_EQ(farm.lease(worker), std::nullopt) << "nothing is leased that could not be recorded";
  const double wall = farm.job(job).wall_seconds;
  for (int i = 0; i < 60; ++i) {
    pass(1);
    EXPECT_THAT(farm.renew(worker, {key(held)}), IsEmpty())
        << "nobody loses a lease by the coordinator's disk";
  }
  EXPECT_EQ(farm.job(job).wall_seconds, wall) << "a pause takes none of the job's time";
  EXPECT_EQ(farm.job(job).tiles_committed, 3);
  EXPECT_THROW(farm.commit(worker, key(held), fake_bytes(held)), StoreError);
  broken = false;
  pass(5);
  EXPECT_EQ(farm.job(job).state, JobState::kRunning);
  EXPECT_EQ(farm.job(job).message, "");
  EXPECT_EQ(farm.commit(worker, key(held), fake_bytes(held)), CommitResult::kAccepted);
  work(farm, worker);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

TEST(Probes, WaitLongerAndLongerUpToFourSeconds) {
  std::vector<double> gaps;
  StorageHealth health;
  health.failed("full", 0);
  double last = 0;
  for (double now = 0; now < 30; now += 0.25) {
    if (!health.take_probe(now)) continue;
    gaps.push_back(now - last);
    last = now;
  }
  EXPECT_THAT(std::vector(gaps.begin(), gaps.begin() + 6), ElementsAre(0.25, 0.5, 1, 2, 4, 4));
  EXPECT_TRUE(health.take_probe(0)) << "a clock that was set back must not hold it up";
}

/// Opens the file that a store lies in and runs a statement, as a failing disk or an editor would.
void tamper(const std::string& path, const char* sql) { Database(path).execute(sql); }

TEST(StoredFilm, WhatIsDamagedPausesItsJobAloneUntilItIsMended) {
  const TemporaryFolder folder;
  FakeClock clock;
  const JobRequest request = small_job(64, 32, 18);
  FarmOptions options = fake_options();
  options.checkpoint_bytes = 1;  // always
  JobId damaged, healthy;
  {
    Farm farm(std::make_unique<SqliteJobStore>(folder.file("s")), clock, options);
    damaged = farm.submit(request);
    work(farm, farm.register_worker(registration()), 4);
    healthy = farm.submit(request);
  }
  tamper(folder.file("s"), "CREATE TABLE saved AS SELECT * FROM layers");
  tamper(folder.file("s"), "UPDATE layers SET bytes = substr(bytes, 1, 200) || x'00' || substr(bytes, 202)");
  Farm farm(std::make_unique<SqliteJobStore>(folder.file("s")), clock, options);
  const WorkerId worker = farm.register_worker(registration());
  for (int turn = 0; turn < 200 && farm.job(healthy).state != JobState::kDone; ++turn) {
    if (const auto grant = farm.lease(worker)) farm.commit(worker, key(*grant), fake_bytes(*grant));
  }
  EXPECT_EQ(farm.job(healthy).state, JobState::kDone);
  EXPECT_EQ(farm.job(damaged).state, JobState::kPaused);
  EXPECT_THAT(farm.job(damaged).message, HasSubstr("corrupt"));
  EXPECT_EQ(farm.job(damaged).tiles_committed, 4);
  EXPECT_THROW(farm.image(damaged), Error);

  tamper(folder.file("s"), "DELETE FROM layers");
  tamper(folder.file("s"), "INSERT INTO layers SELECT * FROM saved");
  clock.advance(6);
  farm.tick();
  EXPECT_EQ(farm.job(damaged).state, JobState::kRunning);
  work(farm, worker);
  EXPECT_EQ(farm.job(damaged).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(damaged), fake_image(request.settings)));
}

class CheckStore : public ::testing::Test {
 protected:
  CheckStore() {
    Farm farm(std::make_unique<SqliteJobStore>(folder.file("s")), clock, fake_options());
    farm.submit(small_job(64, 32, 18));
    work(farm, farm.register_worker(registration()), 4);
  }
  std::vector<std::string> problems() {
    SqliteJobStore store(folder.file("s"));
    return check_store(store);
  }
  const TemporaryFolder folder;
  const FakeClock clock;
};

TEST_F(CheckStore, AgreesWithWhatTheFarmWrote) { EXPECT_THAT(problems(), IsEmpty()); }

TEST_F(CheckStore, NamesATileWhosePartialIsGone) {
  tamper(folder.file("s"), "DELETE FROM spool WHERE tile=2");
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("samples in cell")));
}

TEST_F(CheckStore, NamesATileThatWasFoldedTwice) {
  tamper(folder.file("s"), "INSERT INTO spool SELECT job, 3000, part, bytes FROM spool WHERE tile=2");
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("samples in cell")));
}

TEST_F(CheckStore, NamesASpoolWithoutItsRow) {
  tamper(folder.file("s"), "UPDATE tiles SET state=0 WHERE tile=1");
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("samples in cell")));
}

TEST_F(CheckStore, NamesATotalThatDoesNotAddUp) {
  tamper(folder.file("s"), "UPDATE jobs SET record = json_set(record, '$.tiles_committed', 3)");
  EXPECT_THAT(problems(), ElementsAre(HasSubstr("4 committed tiles")));
}

TEST(GroupCommit, ThreadsThatCommitAtTheSameTimeAreAllDurable) {
  const TemporaryFolder folder;
  constexpr int kThreads = 8, kEach = 5;
  {
    SqliteJobStore store(folder.file("s"));
    JobRecord record;
    record.id = JobId{"j1"};
    record.bundle_digest = "d";
    record.settings = small_settings(64, 32, 18);
    store.add_job(record, "manifest", {});
    std::vector<std::thread> threads;
    for (int t = 0; t < kThreads * kEach; ++t) {
      TileRecord tile;
      tile.id = TileId{t};
      tile.tile = {{0, 0, 1, 1}, t, t + 1};
      tile.state = TileState::kLeased;
      tile.attempt = 1;
      tile.worker = WorkerId{"w1"};
      store.add_tiles(record.id, {tile});
    }
    for (int t = 0; t < kThreads; ++t) {
      threads.emplace_back([&, t] {
        for (int i = 0; i < kEach; ++i) {
          TileRecord tile;
          tile.id = TileId{t * kEach + i};
          tile.attempt = 1;
          tile.worker = WorkerId{"w1"};
          EXPECT_TRUE(store.commit_tile(record, tile, "partial"));
          store.flush();
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
  SqliteJobStore store(folder.file("s"));
  int spooled = 0;
  store.for_each_spooled(JobId{"j1"}, [&](const std::string& bytes) { spooled += bytes == "partial"; });
  EXPECT_EQ(spooled, kThreads * kEach);
  for (const TileRecord& tile : store.tiles(JobId{"j1"})) EXPECT_EQ(tile.state, TileState::kCommitted);
}

}  // namespace
}  // namespace lightmill
