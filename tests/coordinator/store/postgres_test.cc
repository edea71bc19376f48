// What PostgreSQL brings along: a lease with an epoch that fences, connections that are lost, files beside
// rows.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "coordinator/store/data_folder.h"
#include "tests/coordinator/core/fake_worker.h"
#include "tests/coordinator/store/postgres_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(PostgresUrl, IsShownWithoutItsPassword) {
  const std::string url = "postgresql://ann:geheim@db.example.org:5433/farm?password=secret&sslmode=require";
  EXPECT_EQ(PostgresUrl(url).shown(), "postgresql://ann@db.example.org:5433/farm");
  for (const char* bad : {"postgresql://ann:geheim%@db/farm", "postgresql://ann:geheim@db/farm?nonsense=1",
                          "postgresql://ann:geheim@db:port:port/", "postgres:/geheim", "geheim"}) {
    const std::string message = message_of([&] {
      const PostgresUrl parsed(bad);
      PostgresConnection(parsed, 1);
    });
    EXPECT_THAT(message, HasSubstr("postgresql://")) << bad;
    EXPECT_THAT(message, Not(HasSubstr("geheim"))) << bad;
  }
  const std::string message = message_of(
      [] { PostgresConnection(PostgresUrl("postgresql://ann:geheim@/farm?host=/nonexistent"), 1); });
  EXPECT_THAT(message, HasSubstr("postgresql://ann@/nonexistent/farm: can't connect"));
  EXPECT_THAT(message, Not(HasSubstr("geheim")));
  EXPECT_THAT(message, Not(HasSubstr("\n")));
}

class Postgres : public ::testing::Test {
 protected:
  void SetUp() override {
    url = fresh_postgres();
    if (url.empty()) GTEST_SKIP() << kNoPostgres;
    sql.emplace(PostgresUrl(url), kLongLease);
  }
  /// The leader's lease, as if it had not been renewed for long.
  void run_out() { sql->execute("UPDATE leader SET expires='2000-01-01'"); }
  /// Ends all connections but the test's own.
  void cut() {
    sql->execute(
        "SELECT pg_terminate_backend(pid, 10000) FROM pg_stat_activity WHERE application_name='lightmill' "
        "AND pid <> pg_backend_pid()");
  }
  JobRecord job() {
    JobRecord record;
    record.id = JobId{"j1"};
    record.bundle_digest = "d";
    record.settings = small_settings(64, 32, 18);
    return record;
  }
  std::string names() { return sql->execute("SELECT string_agg(id, ',') FROM jobs").text(0, 0); }
  std::vector<std::string> files() {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(folder.file("layers")))
      found.push_back(entry.path().filename());
    return found;
  }
  const TemporaryFolder folder;
  std::string url;
  std::optional<PostgresConnection> sql;
};

TEST_F(Postgres, LeaseIsHeldByOneUntilItRunsOutByTheDatabasesClock) {
  PostgresLease first(PostgresUrl(url), kLongLease), second(PostgresUrl(url), 1);
  ASSERT_TRUE(first.try_take());
  first.announce("a:7070");
  EXPECT_FALSE(second.try_take());
  EXPECT_EQ(second.holder(), "a:7070");
  run_out();
  // The server itself must have run for the length of a lease.
  while (!second.try_take()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_GT(second.epoch(), first.epoch());
  EXPECT_THROW(first.confirm(0), StoreError);
  ASSERT_TRUE(first.ended());
  EXPECT_TRUE(first.ended()->taken_over);
  EXPECT_FALSE(second.ended());
}

TEST_F(Postgres, LeaseOfALeaderThatEndsIsFreeAtOnce) {
  { const PostgresFarm farm(url, folder.path()); }
  PostgresLease next(PostgresUrl(url), kLongLease);
  EXPECT_TRUE(next.try_take());
}

TEST_F(Postgres, LeaseIsRenewedWhileTheLeaderDoesNothing) {
  PostgresLease lease(PostgresUrl(url), 0.3);
  ASSERT_TRUE(lease.try_take());
  const auto expires = [&] { return sql->execute("SELECT expires FROM leader").text(0, 0); };
  const std::string before = expires();
  while (expires() == before) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

TEST_F(Postgres, OldLeaderWritesNothing) {
  PostgresFarm old(url, folder.path());
  old.store->add_job(job(), "manifest", {});
  sql->execute("UPDATE leader SET held=false");
  PostgresFarm current(url, folder.path());
  TileRecord tile;
  tile.id = TileId{0};
  tile.tile = {{0, 0, 2, 1}, 0, 1};
  current.store->add_tiles(JobId{"j1"}, {tile});
  tile.state = TileState::kLeased;
  tile.attempt = 1;
  tile.worker = WorkerId{"w1"};
  current.store->save_tile(job(), tile);

  TileRecord committed = tile;
  committed.state = TileState::kCommitted;
  EXPECT_THROW(old.store->commit_tile(job(), committed, "partial"), StoreError);
  EXPECT_THROW(old.store->flush(), StoreError);
  EXPECT_THROW(old.store->probe(), StoreError) << "trying again does not help";
  EXPECT_THROW(old.store->checkpoint(JobId{"j1"}, {"old film", "old"}, false), StoreError);
  ASSERT_TRUE(old.lease.ended());
  EXPECT_TRUE(old.lease.ended()->taken_over);
  EXPECT_EQ(current.store->tiles(JobId{"j1"}), std::vector{tile});
  EXPECT_EQ(current.store->snapshot(JobId{"j1"}).film, "");
  EXPECT_TRUE(current.store->commit_tile(job(), committed, "partial"));
  EXPECT_NO_THROW(current.store->flush());
}

TEST_F(Postgres, TakeoverWaitsForTheTransactionUnderWay) {
  PostgresFarm old(url, folder.path());
  sql->execute("UPDATE leader SET held=false");
  sql->execute("BEGIN; UPDATE fence SET writes=writes+1");  // as the old leader would
  std::atomic<bool> taken = false;
  std::thread thread([&] {
    PostgresLease next(PostgresUrl(url), kLongLease);
    taken = next.try_take();
  });
  PostgresConnection look(PostgresUrl(url), kLongLease);
  while (look.execute("SELECT 1 FROM pg_stat_activity WHERE wait_event_type='Lock'").empty()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_FALSE(taken);
  sql->execute("COMMIT");
  thread.join();
  EXPECT_TRUE(taken);
}

TEST_F(Postgres, ConnectionThatIsCutIsMendedByAProbe) {
  PostgresFarm farm(url, folder.path());
  farm.store->add_job(job(), "manifest", {});
  cut();
  EXPECT_THROW(farm.store->next_number("job"), StoreError);
  EXPECT_THROW(farm.store->next_number("job"), StoreError) << "not before a probe";
  farm.store->probe();
  EXPECT_EQ(farm.store->next_number("job"), 1);
  farm.store->flush();
  EXPECT_FALSE(farm.lease.ended());
}

TEST_F(Postgres, CommitThatWasNotHeardOfEndsTheLeaseSoThatAllIsLoadedAnew) {
  PostgresFarm farm(url, folder.path());
  farm.store->add_job(job(), "manifest", {});
  sql->execute("UPDATE fence SET writes=writes+1");  // what such a commit leaves behind
  cut();
  EXPECT_THROW(farm.store->next_number("job"), StoreError);
  EXPECT_THROW(farm.store->probe(), StoreError);
  ASSERT_TRUE(farm.lease.ended());
  EXPECT_FALSE(farm.lease.ended()->taken_over);
}

TEST_F(Postgres, NothingIsFlushedThatADatabaseHasLostInACrash) {
  PostgresFarm farm(url, folder.path());
  farm.store->add_job(job(), "manifest", {});
  farm.store->flush();
  farm.store->add_tiles(JobId{"j1"}, {});            // not flushed yet
  sql->execute("UPDATE fence SET writes=writes-1");  // what a crash leaves behind
  EXPECT_THROW(farm.store->flush(), StoreError);
  ASSERT_TRUE(farm.lease.ended());
  EXPECT_FALSE(farm.lease.ended()->taken_over);
  EXPECT_THROW(farm.store->save_job(job()), StoreError);
}

TEST_F(Postgres, FilesWithoutARowGoAndDamagedOnesAreNamed) {
  {
    PostgresFarm farm(url, folder.path());
    farm.store->add_job(job(), "manifest", {});
    farm.store->checkpoint(JobId{"j1"}, {"film 1", "batches 1"}, false);
    farm.store->checkpoint(JobId{"j1"}, {"film 2", "batches 2"}, false);
    EXPECT_EQ(files().size(), 2u) << "replaced ones are gone";
  }
  std::ofstream(folder.file("layers/j1-film-1-9-left")) << "by a crash";
  PostgresFarm farm(url, folder.path());
  ASSERT_EQ(files().size(), 2u);
  EXPECT_EQ(farm.store->snapshot(JobId{"j1"}).batches, "batches 2");
  for (const std::string& file : files()) std::ofstream(folder.file("layers/" + file)) << "film 3";
  EXPECT_THAT(message_of([&] { farm.store->snapshot(JobId{"j1"}); }), HasSubstr("corrupt"));
  EXPECT_THROW(farm.store->snapshot(JobId{"j1"}), DamagedLayers);
  std::ofstream(folder.file("layers/of-another-job")) << "film";
  std::filesystem::remove(folder.file("layers/" + files().front()));
  EXPECT_THROW(farm.store->snapshot(JobId{"j1"}), DamagedLayers) << "it is gone, and the folder is there";
  for (const std::string& file : files()) std::filesystem::remove(folder.file("layers/" + file));
  EXPECT_THAT(message_of([&] { farm.store->snapshot(JobId{"j1"}); }),
              HasSubstr("is the shared folder there"));
  EXPECT_THROW(
      {
        try {
          farm.store->snapshot(JobId{"j1"});
        } catch (const DamagedLayers&) {  // which would have the job rendered again
        }
      },
      Error);
}

TEST_F(Postgres, DatabaseAndFolderBelongTogether) {
  { const PostgresFarm farm(url, folder.path()); }
  const TemporaryFolder other;
  EXPECT_THAT(message_of([&] { PostgresFarm(url, other.path()); }), HasSubstr("is it mounted"));
  const std::string second = fresh_postgres();
  std::ofstream(folder.file("layers/j1-film-1-1-x")) << "of the first";
  EXPECT_THAT(message_of([&] { PostgresFarm(second, folder.path()); }), HasSubstr("another database"));
  EXPECT_TRUE(std::filesystem::exists(folder.file("layers/j1-film-1-1-x")));
  { const PostgresFarm farm(second, other.path()); }
  EXPECT_THAT(message_of([&] { PostgresFarm(url, other.path()); }), HasSubstr("another database"));
  EXPECT_THAT(message_of([&] { DataFolder{folder.path()}; }), HasSubstr("--store"));
  std::ofstream(folder.file("jobs.sqlite")) << "";
  EXPECT_THAT(message_of([&] { DataFolder(folder.path(), true); }), HasSubstr("without --store"));
}

TEST_F(Postgres, TablesOfANewerVersionAreRefused) {
  { const PostgresFarm farm(url, folder.path()); }
  sql->execute("UPDATE meta SET value='99' WHERE key='schema'");
  EXPECT_THAT(message_of([&] { PostgresFarm(url, folder.path()); }), HasSubstr("newer version"));
}

TEST_F(Postgres, JobPausesWhileTheDatabaseIsAwayAndTheImageIsTheSame) {
  FakeClock clock;
  FarmOptions options = fake_options();
  options.checkpoint_bytes = 1;  // always
  const JobRequest request = small_job(96, 96, 40);
  PostgresLease lease(PostgresUrl(url), kLongLease);
  ASSERT_TRUE(lease.try_take());
  JobId id;
  {
    Farm farm(std::make_unique<PostgresJobStore>(lease, folder.path()), clock, options);
    id = farm.submit(request);
    const WorkerId worker = farm.register_worker(registration());
    work(farm, worker, 3);
    const LeaseGrant held = farm.lease(worker).value();
    cut();
    EXPECT_THROW(farm.commit(worker, {held.job, held.tile_id, held.attempt}, fake_bytes(held)), Error);
    farm.tick();
    EXPECT_EQ(farm.job(id).state, JobState::kPaused);
    EXPECT_THAT(farm.job(id).message, HasSubstr("the job store failed"));
    clock.advance(5);
    farm.tick();
    EXPECT_EQ(farm.job(id).state, JobState::kRunning);
    EXPECT_EQ(farm.commit(worker, {held.job, held.tile_id, held.attempt}, fake_bytes(held)),
              CommitResult::kAccepted);
    work(farm, worker, 2);
  }
  Farm farm(std::make_unique<PostgresJobStore>(lease, folder.path()), clock, options);
  EXPECT_EQ(farm.job(id).tiles_committed, 6);
  work(farm, farm.register_worker(registration()));
  EXPECT_EQ(farm.job(id).state, JobState::kDone);
  EXPECT_TRUE(same_pixels(farm.image(id), fake_image(request.settings)));
}

}  // namespace
}  // namespace lightmill
