// A store that an old version left in the middle of its work: store_schema3.sql has a finished job as that
// version wrote it, a running one whose coordinator was killed (a tile committed and in the spool, one leased
// for the third time), and a paused one. The tables are that version's; the partial is put in here, its
// format is the same.
#include <gtest/gtest.h>

#include <fstream>

#include "common/base/digest.h"
#include "coordinator/merge/store_check.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill {
namespace {

using namespace testing;

const JobId kDone{"j1"}, kRunning{"j2"}, kPaused{"j3"};
constexpr TileSpec kCommitted{{0, 0, 1, 2}, 0, 1};  // tile 0 of the running job

class Upgrade : public ::testing::Test {
 protected:
  Upgrade() {
    std::ifstream recorded(std::string(LIGHTMILL_SOURCE_DIR) + "/tests/coordinator/store/store_schema3.sql");
    const std::string sql((std::istreambuf_iterator<char>(recorded)), std::istreambuf_iterator<char>());
    EXPECT_GT(sql.size(), 5000u);
    RenderSettings settings = small_settings(64, 64, 4);
    settings.seed = 3;
    settings.grid.interleaved = false;
    const std::string partial = encode_partial(fake_partial(kCommitted, settings));
    Database old(path());
    old.execute(sql.c_str());
    Transaction transaction(old);
    Statement(old, "INSERT INTO spool VALUES('j2', 0, 0, ?)").bind_blob(partial).run();
    const std::string digest = encoded_digest(partial);
    Statement(old, "UPDATE tiles SET digest=? WHERE job='j2' AND tile=0").bind(digest).run();
    transaction.commit();
  }
  std::string path() const { return folder.file("old.sqlite"); }
  const TemporaryFolder folder;
  FakeClock clock;
};

TEST_F(Upgrade, WhatTheOldVersionHadBegunIsFinishedByThisOne) {
  {
    Farm farm(std::make_unique<SqliteJobStore>(path()), clock, fake_options());
    ASSERT_EQ(farm.job_count(), 3u);
    EXPECT_EQ(farm.job(kDone).state, JobState::kDone);
    EXPECT_EQ(farm.job(kRunning).state, JobState::kRunning);
    EXPECT_EQ(farm.job(kRunning).tiles_committed, 1);
    EXPECT_EQ(farm.job(kPaused).state, JobState::kPaused);
    EXPECT_EQ(farm.job(kPaused).priority, 2);
    const std::string late = encode_partial(fake_partial({{1, 0, 2, 2}, 0, 1}, farm.job(kRunning).settings));
    EXPECT_EQ(farm.commit(WorkerId{"w2"}, {kRunning, TileId{1}, 3}, late), CommitResult::kStale)
        << "its lease ended with the old coordinator";

    const WorkerId worker = farm.register_worker(registration());
    EXPECT_EQ(worker.value, "w3") << "no worker's name comes twice";
    const auto grant = farm.lease(worker);
    ASSERT_TRUE(grant);
    EXPECT_EQ(grant->tile_id, TileId{1});
    EXPECT_EQ(grant->attempt, 4);
    EXPECT_EQ(farm.commit(worker, {grant->job, grant->tile_id, grant->attempt}, fake_bytes(*grant)),
              CommitResult::kAccepted);
    work(farm, worker);
    farm.resume(kPaused);
    work(farm, worker);
    for (const JobId& id : {kRunning, kPaused}) {
      const JobStatus job = farm.job(id);
      EXPECT_EQ(job.state, JobState::kDone);
      EXPECT_EQ(job.packets_done, job.packets_total);
      EXPECT_TRUE(same_pixels(farm.image(id), fake_image(job.settings))) << id.value;
    }
    const Image image = farm.image(kDone);
    EXPECT_EQ(
        sha256_hex({reinterpret_cast<const char*>(image.data.data()), image.data.size() * sizeof(float)}),
        "a0eb74ddaa3f8a306a8dac05ca5a9139be70698225173bd93a8024e4c9a55c05")
        << "what the old version fetched";
    EXPECT_EQ(farm.submit(small_job(8, 8, 1)).value, "j4");
  }
  SqliteJobStore again(path());
  EXPECT_EQ(check_store(again), std::vector<std::string>());
  EXPECT_EQ(again.jobs().size(), 4u);
}

TEST_F(Upgrade, AnAbortedOpeningLeavesTheOldTables) {
  // The tables of the next schema are half there, as no transaction would leave them: nothing is guessed.
  Database(path()).execute("ALTER TABLE tiles ADD COLUMN rival_worker TEXT NOT NULL DEFAULT ''");
  EXPECT_THROW(SqliteJobStore{path()}, StoreError);
  Database old(path());
  Statement schema(old, "SELECT value FROM meta WHERE key='schema'");
  ASSERT_TRUE(schema.step());
  EXPECT_EQ(schema.integer(0), 3);
  EXPECT_THROW(Statement(old, "SELECT rival_attempt FROM tiles"), StoreError) << "rolled back as a whole";
}

}  // namespace
}  // namespace lightmill
