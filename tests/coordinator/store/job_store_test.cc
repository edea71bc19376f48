// All stores keep what they were given; the durable ones also across a reopening.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "coordinator/merge/store_check.h"
#include "coordinator/store/blob_store.h"
#include "coordinator/store/data_folder.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "tests/coordinator/core/fake_worker.h"
#include "tests/coordinator/store/any_store.h"

namespace lightmill {
namespace {

using testing::StoreKind;
using testing::TemporaryFolder;

JobRecord record(const std::string& id) {
  JobRecord r;
  r.id = JobId{id};
  r.frame = frame_of(r.id);
  r.name = "a \"name\" with \xff bytes";
  r.bundle_digest = "d1";
  r.settings = testing::small_settings(64, 32, 40);
  r.priority = -3;
  r.pool = "fast";
  r.submitter = "ann";
  r.max_workers = 3;
  r.after = {JobId{"j0"}, JobId{"j00"}};
  r.message = "m";
  r.missing_light = {"about a \"tenth\"", "and more"};
  r.arithmetic_class = "c";
  r.quantum_exponent = -50;
  r.wall_seconds = 1.5;
  r.counters.nonfinite = 7;
  r.dropped.of(DropKind::kNegative) = {7, 1.0 / 3};
  r.dropped.of(DropKind::kCapped) = {uint64_t{1} << 60, 1e38};
  r.image_mean = 0.1;
  r.pixel_samples = 123456789012;
  return r;
}

TileRecord tile(int64_t id) {
  TileRecord t;
  t.id = TileId{id};
  t.tile = {{0, 0, 2, 1}, id, id + 1};
  return t;
}

class Stores : public ::testing::TestWithParam<StoreKind> {
 protected:
  void SetUp() override {
    if (!stores.usable()) GTEST_SKIP() << testing::kNoPostgres;
    reopen();
  }
  void reopen() { store = &stores.reopen(); }
  std::vector<std::string> spool(const std::string& job) {
    std::vector<std::string> all;
    store->for_each_spooled(JobId{job}, [&](const std::string& bytes) { all.push_back(bytes); });
    return all;
  }
  testing::AnyStore stores{GetParam()};
  JobStore* store = nullptr;
};

TEST_P(Stores, KeepSequencesAndTheirFrames) {
  SequenceRecord shot;
  shot.id = SequenceId{"s1"};
  shot.request.name = "a \"shot\" with \xff";
  shot.request.priority = 2;
  shot.request.pool = "fast";
  shot.request.submitter = "ann";
  shot.request.max_workers = 7;
  shot.request.after = {JobId{"j1"}, JobId{"s9"}};
  shot.request.order = FrameOrder::kCoarseFirst;
  shot.request.fps = 23.976;
  store->save_sequence(shot);
  SequenceRecord second = shot;
  second.id = SequenceId{"s2"};
  store->save_sequence(second);
  store->add_jobs({{record("s1.-2"), "manifest"}, {record("s1.10"), "manifest"}});
  shot.request.priority = 5;
  store->save_sequence(shot);
  JobRecord done = record("s1.10"), failed = record("s1.-2");
  done.state = JobState::kDone;
  failed.state = JobState::kFailed;
  store->save_jobs({done, failed});
  reopen();
  const auto sequences = store->sequences();
  ASSERT_EQ(sequences.size(), 2u);
  EXPECT_EQ(sequences[0].id.value, "s1");
  const SequenceRequest& r = sequences[0].request;
  EXPECT_EQ(r.name.substr(0, 13), "a \"shot\" with");
  EXPECT_EQ(r.priority, 5);
  EXPECT_EQ(r.pool, "fast");
  EXPECT_EQ(r.submitter, "ann");
  EXPECT_EQ(r.max_workers, 7);
  EXPECT_EQ(r.after, shot.request.after);
  EXPECT_EQ(r.order, FrameOrder::kCoarseFirst);
  EXPECT_EQ(r.fps, 23.976);
  const auto jobs = store->jobs();
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(jobs[0].frame, (FrameOf{SequenceId{"s1"}, -2}));
  EXPECT_EQ(jobs[0].state, JobState::kFailed);
  EXPECT_EQ(jobs[1].frame, (FrameOf{SequenceId{"s1"}, 10}));
  EXPECT_EQ(jobs[1].state, JobState::kDone);
}

TEST_P(Stores, KeepJobsInOrder) {
  for (const char* id : {"j1", "j2", "j10"}) store->add_job(record(id), "manifest", {});
  JobRecord changed = record("j2");
  changed.state = JobState::kRunning;
  store->save_job(changed);
  reopen();
  const auto jobs = store->jobs();
  ASSERT_EQ(jobs.size(), 3u);
  EXPECT_EQ(jobs[0].id.value, "j1");
  EXPECT_EQ(jobs[2].id.value, "j10");
  EXPECT_EQ(jobs[1].state, JobState::kRunning);
  EXPECT_EQ(jobs[0].settings.spp, 40);
  EXPECT_EQ(jobs[0].settings.grid, record("j1").settings.grid);
  EXPECT_EQ(jobs[0].quantum_exponent, -50);
  EXPECT_EQ(jobs[0].counters, record("j1").counters);
  EXPECT_EQ(jobs[0].pixel_samples, 123456789012);
  EXPECT_EQ(jobs[0].wall_seconds, 1.5);
  EXPECT_EQ(jobs[0].submitter, "ann");
  EXPECT_EQ(jobs[0].max_workers, 3);
  EXPECT_EQ(jobs[0].after, record("j1").after);
  EXPECT_EQ(jobs[0].missing_light, record("j1").missing_light);
  EXPECT_EQ(store->bundle_json("d1"), "manifest");
  EXPECT_EQ(store->bundle_json("d2"), std::nullopt);
}

TEST_P(Stores, CommitOnlyUnderTheLeaseAndOnce) {
  const JobRecord job = record("j1");
  store->add_job(job, "manifest", {});
  store->add_tiles(job.id, {tile(0), tile(1)});
  TileRecord leased = tile(1);
  leased.state = TileState::kLeased;
  leased.attempt = 2;
  leased.worker = WorkerId{"w1"};
  TileRecord committed = leased;
  committed.state = TileState::kCommitted;
  committed.digest = "digest";
  const std::string partial(5000, 'p');
  EXPECT_FALSE(store->commit_tile(job, committed, partial)) << "not leased";
  store->save_tile(job, leased);
  TileRecord stale = committed;
  stale.attempt = 1;
  EXPECT_FALSE(store->commit_tile(job, stale, partial)) << "an older attempt";
  stale = committed;
  stale.worker = WorkerId{"w2"};
  EXPECT_FALSE(store->commit_tile(job, stale, partial)) << "somebody else's lease";
  EXPECT_TRUE(spool("j1").empty());
  EXPECT_TRUE(store->commit_tile(job, committed, partial));
  EXPECT_FALSE(store->commit_tile(job, committed, partial)) << "twice";
  reopen();
  EXPECT_EQ(spool("j1"), (std::vector{partial}));
  EXPECT_EQ(store->tiles(job.id), (std::vector{tile(0), committed}));
}

TEST_P(Stores, CommitAPilotOnlyUnderItsLeaseAndWithItsPlan) {
  JobRecord job = record("j1");
  job.settings.integrator = Integrator::kAuto;
  store->add_job(job, "manifest", {});
  TileRecord pilot;
  pilot.id = TileId{0};
  store->add_tiles(job.id, {pilot});
  pilot.state = TileState::kLeased;
  pilot.attempt = 1;
  pilot.worker = WorkerId{"w1"};
  store->save_tile(job, pilot);
  TileRecord committed = pilot;
  committed.state = TileState::kCommitted;
  committed.digest = "digest";
  JobRecord planned = job;
  planned.settings.plan = testing::fake_pilot().chosen;
  TileRecord stale = committed;
  stale.worker = WorkerId{"w2"};
  EXPECT_FALSE(store->commit_pilot(planned, stale, "report"));
  reopen();
  EXPECT_TRUE(needs_pilot(store->jobs()[0].settings));
  EXPECT_EQ(store->pilot(job.id), "");
  const std::string report(2500, 'r');
  EXPECT_TRUE(store->commit_pilot(planned, committed, report));
  EXPECT_FALSE(store->commit_pilot(planned, committed, "another")) << "twice";
  reopen();
  EXPECT_EQ(store->jobs()[0].settings.plan, testing::fake_pilot().chosen);
  EXPECT_EQ(store->pilot(job.id), report);
  EXPECT_EQ(store->tiles(job.id), (std::vector{committed}));
  EXPECT_TRUE(spool("j1").empty());
}

TEST_P(Stores, CheckpointReplacesTheSpool) {
  const JobRecord job = record("j1");
  store->add_job(job, "manifest", {});
  store->add_job(record("j2"), "manifest", {});
  for (const char* id : {"j1", "j2"}) {
    JobRecord owner = record(id);
    TileRecord t = tile(0);
    store->add_tiles(owner.id, {t});
    t.state = TileState::kLeased;
    t.attempt = 1;
    t.worker = WorkerId{"w1"};
    store->save_tile(owner, t);
    t.state = TileState::kCommitted;
    EXPECT_TRUE(store->commit_tile(owner, t, std::string("partial of ") + id));
  }
  EXPECT_TRUE(store->snapshot(job.id).film.empty());
  const std::string film(2500, 'f');
  store->checkpoint(job.id, {film, "b"}, false);
  store->checkpoint(job.id, {film + "2", "b2"}, false);
  reopen();
  EXPECT_EQ(store->snapshot(job.id).film, film + "2");
  EXPECT_EQ(store->snapshot(job.id).batches, "b2");
  EXPECT_TRUE(spool("j1").empty());
  EXPECT_EQ(spool("j2").size(), 1u) << "another job's spool stays";
}

TEST_P(Stores, KeepCurveReferenceAndNumbers) {
  Image reference(64, 32);
  for (size_t i = 0; i < reference.data.size(); ++i) reference.data[i] = static_cast<float>(i) * 0.25f;
  store->add_job(record("j1"), "manifest", reference);
  store->add_job(record("j2"), "manifest", {});
  ErrorPoint point;
  point.spp = 4;
  store->add_point(JobId{"j1"}, point);
  point.spp = 8;
  point.relmse = 0.25;
  point.boxes[1] = {0.5, 0.25, 1, 0.75};
  store->add_point(JobId{"j1"}, point);
  EXPECT_EQ(store->next_number("worker"), 1);
  EXPECT_EQ(store->next_number("worker"), 2);
  reopen();
  EXPECT_EQ(store->next_number("worker"), 3);
  EXPECT_EQ(store->next_number("job"), 1);
  EXPECT_TRUE(testing::same_pixels(store->reference(JobId{"j1"}), reference));
  EXPECT_TRUE(store->reference(JobId{"j2"}).data.empty());
  const auto curve = store->curve(JobId{"j1"});
  ASSERT_EQ(curve.size(), 2u);
  EXPECT_EQ(curve[0].spp, 4);
  EXPECT_EQ(curve[1].relmse, 0.25);
  EXPECT_EQ(curve[1].boxes, point.boxes);
}

TEST_P(Stores, GoOnAfterAProbe) {
  store->add_job(record("j1"), "manifest", {});
  store->flush();
  store->probe();
  store->add_tiles(JobId{"j1"}, {tile(0)});
  store->flush();
  reopen();
  EXPECT_EQ(store->tiles(JobId{"j1"}).size(), 1u);
}

INSTANTIATE_TEST_SUITE_P(All, Stores, testing::kAllStores, testing::store_name);

TEST(SqliteStore, RefusesAnotherSchemaAndNoDatabase) {
  const TemporaryFolder folder;
  { SqliteJobStore store(folder.file("a.sqlite")); }
  {
    Database db(folder.file("a.sqlite"));
    db.execute("UPDATE meta SET value=99");
  }
  EXPECT_THROW(SqliteJobStore{folder.file("a.sqlite")}, StoreError);
  std::ofstream(folder.file("b.sqlite")) << std::string(10000, 'x');
  EXPECT_THROW(SqliteJobStore{folder.file("b.sqlite")}, StoreError);
  EXPECT_THROW(SqliteJobStore{folder.file("none/c.sqlite")}, StoreError);
}

// A finished job as the version with schema 2 left it (sqlite3 .dump of its file). Jobs outlive upgrades:
// what can't be migrated must at least be refused with a sentence, never read wrongly.
TEST(SqliteStore, MigratesTheTablesOfSchemaTwo) {
  const TemporaryFolder folder;
  std::ifstream recorded(std::string(LIGHTMILL_SOURCE_DIR) + "/tests/coordinator/store/store_schema2.sql");
  const std::string sql((std::istreambuf_iterator<char>(recorded)), std::istreambuf_iterator<char>());
  ASSERT_GT(sql.size(), 5000u);
  Database(folder.file("old.sqlite")).execute(sql.c_str());
  for (int opening = 0; opening < 2; ++opening) {
    SqliteJobStore store(folder.file("old.sqlite"));
    ASSERT_EQ(store.jobs().size(), 1u);
    const JobRecord job = store.jobs()[0];
    EXPECT_EQ(job.state, JobState::kDone);
    EXPECT_EQ(job.submitter, "") << "nobody was asked then";
    EXPECT_EQ(job.max_workers, 0);
    EXPECT_EQ(store.tiles(job.id).size(), 3u);
    EXPECT_EQ(store.curve(job.id).size(), 3u);
    EXPECT_EQ(check_store(store), std::vector<std::string>());
    const Image image = Film::restore(store.snapshot(job.id).film).resolve();
    const std::string pixels(reinterpret_cast<const char*>(image.data.data()),
                             image.data.size() * sizeof(float));
    EXPECT_EQ(sha256_hex(pixels), "a0eb74ddaa3f8a306a8dac05ca5a9139be70698225173bd93a8024e4c9a55c05")
        << "what that version fetched";
    EXPECT_EQ(store.next_number("job"), 2 + opening) << "ids go on";
  }
  Database(folder.file("old.sqlite")).execute("UPDATE meta SET value=1 WHERE key='schema'");
  EXPECT_THROW(SqliteJobStore{folder.file("old.sqlite")}, StoreError);
}

TEST(Blobs, VerifiedOnTheirWayIn) {
  const TemporaryFolder folder;
  BlobStore blobs(folder.file("blobs"));
  const std::string content = "some content";
  const std::string digest = sha256_hex(content);
  EXPECT_FALSE(blobs.contains(digest));
  {
    auto writer = blobs.begin(digest, content.size());
    writer.write(content.substr(0, 3));
  }  // given up
  {
    auto writer = blobs.begin(digest, content.size());
    writer.write("some kontent");
    EXPECT_THROW(writer.finish(), Error);
  }
  {
    auto writer = blobs.begin(digest, content.size() - 1);
    EXPECT_THROW(writer.write(content), Error);
  }
  EXPECT_FALSE(blobs.contains(digest));
  EXPECT_TRUE(std::filesystem::is_empty(folder.file("blobs"))) << "nothing is left behind";
  {
    auto writer = blobs.begin(digest, content.size());
    writer.write(content);
    writer.finish();
  }
  EXPECT_TRUE(blobs.contains(digest));
  EXPECT_EQ(blobs.size(digest), content.size());
  EXPECT_EQ(sha256_file(blobs.path(digest)), digest);
  for (const char* bad : {"", "../../etc/passwd", "abc"}) {
    EXPECT_THROW(blobs.contains(bad), Error);
    EXPECT_THROW(blobs.begin(bad, 1), Error);
  }
  EXPECT_THROW(blobs.path(sha256_hex("other")), Error);
}

TEST(DataFolders, AreHeldByOneProcessAtATime) {
  const TemporaryFolder folder;
  {
    const DataFolder first(folder.file("data"));
    EXPECT_THROW(DataFolder{folder.file("data")}, Error);
  }
  EXPECT_NO_THROW(DataFolder{folder.file("data")});
  EXPECT_THROW(DataFolder{"/proc/none"}, Error);
}

}  // namespace
}  // namespace lightmill
