// Films that the disk has damaged: built again from what is there, the rest is rendered again, and the image
// is the same.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/store/sqlite/sqlite_db.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr const char* kDamageFilm =
    "UPDATE layers SET bytes = substr(bytes, 1, 200) || x'00' || substr(bytes, 202) WHERE kind='film'";

class FilmRepairTest : public ::testing::Test {
 protected:
  FilmRepairTest() {
    options.checkpoint_bytes = 1;  // after every commit
    options.log = [this](const std::string& line) { logged.push_back(line); };
    options.quarantine = [this](const LeaseKey& lease, const WorkerId&, const std::string& reason,
                                const std::string& bytes) {
      evidence.push_back(lease.job.value + ": " + reason + ": " + std::to_string(bytes.size()));
    };
  }
  void open() { farm = std::make_unique<Farm>(std::make_unique<SqliteJobStore>(path), clock, options); }
  /// The coordinator ends, its disk does this, and it starts again.
  void restart_with(const char* sql) {
    farm.reset();
    Database(path).execute(sql);
    open();
    worker = farm->register_worker(registration());
  }
  void begin(const JobRequest& request, int tiles) {
    open();
    job = farm->submit(request);
    worker = farm->register_worker(registration());
    work(*farm, worker, tiles);
  }
  void pass(double seconds) {
    clock.advance(seconds);
    farm->tick();
  }
  /// A commit, or whoever looks at the image, finds the damage; two looks later it is mended.
  void find_and_mend() {
    EXPECT_THROW(farm->image(job), Error);
    EXPECT_EQ(farm->job(job).state, JobState::kPaused);
    pass(0);
    EXPECT_EQ(farm->job(job).state, JobState::kPaused) << "one look is not proof";
    pass(6);
    EXPECT_EQ(farm->job(job).state, JobState::kRunning);
  }
  void expect_done_and_right(const RenderSettings& settings) {
    work(*farm, worker);
    EXPECT_EQ(farm->job(job).state, JobState::kDone);
    EXPECT_EQ(farm->job(job).packets_done, farm->job(job).packets_total);
    EXPECT_TRUE(same_pixels(farm->image(job), fake_image(settings)));
  }

  const TemporaryFolder folder;
  const std::string path = folder.file("s");
  FakeClock clock;
  FarmOptions options = fake_options();
  std::vector<std::string> logged, evidence;
  std::unique_ptr<Farm> farm;
  JobId job;
  WorkerId worker;
};

class FilmRepairOf : public FilmRepairTest, public ::testing::WithParamInterface<Integrator> {};

TEST_P(FilmRepairOf, WhatCannotBeBuiltAgainIsRenderedAgain) {
  const JobRequest request = small_job(96, 64, 20, GetParam());
  begin(request, 9);
  const int64_t committed = farm->job(job).tiles_committed;
  ASSERT_GE(committed, 8);
  restart_with(kDamageFilm);
  const LeaseGrant leased = farm->lease(worker).value();
  find_and_mend();
  const JobStatus status = farm->job(job);
  EXPECT_EQ(status.tiles_committed, 0);
  EXPECT_EQ(status.spp, 0);
  EXPECT_EQ(status.counters, RenderCounters());
  const std::string many = std::to_string(committed) + " of " + std::to_string(committed);
  EXPECT_THAT(status.message,
              AllOf(HasSubstr("could not be read"), HasSubstr(many + " tiles are rendered again")));
  EXPECT_THAT(logged, Contains(HasSubstr(many + " tiles are rendered again")));
  EXPECT_THAT(evidence, Contains(HasSubstr(job.value + ": the stored film")));
  EXPECT_TRUE(farm->curve(job).points.empty());
  const LeaseKey stale{job, leased.tile_id, leased.attempt};
  EXPECT_EQ(farm->commit(worker, stale, fake_bytes(leased)), CommitResult::kStale);
  expect_done_and_right(request.settings);
  EXPECT_EQ(farm->job(job).message, "");
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutPilot, FilmRepairOf,
                         ::testing::Values(Integrator::kBdpt, Integrator::kAuto),
                         [](const auto& info) { return integrator_name(info.param); });

TEST_F(FilmRepairTest, AFilmWhosePartialsAreKeptIsBuiltAgain) {
  options.spot_check = 1'000'000;  // which keeps partials
  const JobRequest request = small_job(96, 64, 20);
  begin(request, 9);
  const size_t points = farm->curve(job).points.size();
  restart_with(kDamageFilm);
  find_and_mend();
  EXPECT_EQ(farm->job(job).tiles_committed, 9);
  EXPECT_EQ(farm->curve(job).points.size(), points);
  EXPECT_THAT(farm->job(job).message, HasSubstr("built again from what is left"));
  restart_with("DELETE FROM spool");  // the snapshot is whole again
  EXPECT_EQ(farm->job(job).tiles_committed, 9);
  expect_done_and_right(request.settings);
}

TEST_F(FilmRepairTest, OfPartialsOnlyTheDamagedAreRenderedAgain) {
  options.checkpoint_bytes = 1e9;  // never
  const JobRequest request = small_job(96, 64, 20);
  begin(request, 9);
  const JobStatus before = farm->job(job);
  restart_with(
      "UPDATE spool SET bytes = substr(bytes, 1, 90) || x'DEADBEEF' || substr(bytes, 95) WHERE tile=4");
  find_and_mend();
  EXPECT_EQ(farm->job(job).tiles_committed, 8);
  EXPECT_LT(farm->job(job).spp, before.spp);
  EXPECT_GT(farm->job(job).spp, 0);
  EXPECT_THAT(farm->job(job).message, HasSubstr("1 of 9 tiles are rendered again"));
  expect_done_and_right(request.settings);
}

TEST_F(FilmRepairTest, ASnapshotIsUsedWhereOnlyAPartialIsDamaged) {
  const JobRequest request = small_job(96, 64, 20);
  begin(request, 6);  // each in the snapshot
  options.checkpoint_bytes = 1e9;
  restart_with("SELECT 1");
  work(*farm, worker, 3);
  const JobStatus before = farm->job(job);
  restart_with(
      "UPDATE spool SET bytes = substr(bytes, 1, 90) || x'DEADBEEF' || substr(bytes, 95) WHERE tile = "
      "(SELECT MAX(tile) FROM spool)");
  find_and_mend();
  EXPECT_EQ(farm->job(job).tiles_committed, before.tiles_committed - 1);
  EXPECT_THAT(farm->job(job).message, HasSubstr("1 of 9 tiles are rendered again"));
  restart_with("SELECT 1");
  work(*farm, worker);
  const JobStatus after = farm->job(job);
  EXPECT_EQ(after.counters.camera_paths, 96u * 64 * 20) << "each counts once";
  expect_done_and_right(request.settings);
}

TEST_F(FilmRepairTest, AJobThatIsDoneSaysHowToMendIt) {
  const JobRequest request = small_job(64, 64, 16);
  begin(request, 1000);
  EXPECT_THROW(farm->retry(job), Error) << "nothing is wrong with it";
  restart_with(kDamageFilm);
  try {
    farm->image(job);
    FAIL() << "it is damaged";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("`lightmill retry " + job.value + "` renders it again"));
  }
  pass(6);
  EXPECT_EQ(farm->job(job).state, JobState::kDone) << "nobody has asked for it";
  farm->retry(job);
  pass(0);
  expect_done_and_right(request.settings);
}

TEST_F(FilmRepairTest, ATimeLimitDoesNotCountWhatIsLost) {
  JobRequest request = small_job(96, 64, 1000);
  request.settings.time_s = 100;
  begin(request, 4);
  for (int i = 0; i < 9; ++i) {
    const LeaseGrant grant = farm->lease(worker).value();
    clock.advance(9);
    farm->commit(worker, {grant.job, grant.tile_id, grant.attempt}, fake_bytes(grant));
  }
  EXPECT_NEAR(farm->job(job).wall_seconds, 81, 1);
  restart_with(kDamageFilm);
  find_and_mend();
  EXPECT_EQ(farm->job(job).wall_seconds, 0);
}

TEST_F(FilmRepairTest, WhatIsDamagedAgainAndAgainWaitsForPeople) {
  options.film_memory_bytes = 1;  // for one film at a time
  JobRequest other = small_job(32, 32, 4);
  other.pool = "nobody";
  begin(small_job(96, 64, 20), 2);
  const JobId elsewhere = farm->submit(other);
  const auto damage = [&] {
    work(*farm, worker, 1);
    farm->image(elsewhere);  // takes the place in memory
    Database(path).execute(kDamageFilm);
  };
  for (int i = 0; i < 3; ++i) {
    damage();
    find_and_mend();
  }
  damage();
  EXPECT_THROW(farm->image(job), Error);
  for (int i = 0; i < 10; ++i) pass(6);
  EXPECT_EQ(farm->job(job).state, JobState::kPaused);
}

}  // namespace
}  // namespace lightmill
