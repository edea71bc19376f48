// Who gets the workers: priority, then even shares by submitter and by job, in runs, with films that stay.
#include <algorithm>
#include <map>
#include <vector>

#include "coordinator/farm/sharing/film_bytes.h"
#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;

class SharingTest : public FarmFixture {
 protected:
  using FarmFixture::FarmFixture;
  JobId submit(const std::string& submitter, int priority = 0, int64_t spp = kMaxSpp) {
    JobRequest request = small_job(64, 64, spp, Integrator::kPt);
    request.submitter = submitter;
    request.priority = priority;
    return farm.submit(request);
  }
  /// Every worker leases a tile, all take a second, and hand in. `seconds` of processors go by for a job's
  /// tile, 1 unless given.
  void turn() {
    std::vector<std::pair<WorkerId, LeaseGrant>> held;
    for (const WorkerId& worker : workers) {
      if (const auto grant = farm.lease(worker)) held.emplace_back(worker, *grant);
    }
    clock.advance(1);
    for (const auto& [worker, grant] : held) {
      const double cost = costs.contains(grant.job) ? costs.at(grant.job) : 2.0;
      ASSERT_EQ(commit(worker, grant, cost), CommitResult::kAccepted);
      served[grant.job] += cost;
      order[worker].push_back(grant.job);
    }
  }
  void hire(int count) {
    for (int i = 0; i < count; ++i) workers.push_back(join());
  }
  std::vector<WorkerId> workers;
  std::map<JobId, double> costs, served;
  std::map<WorkerId, std::vector<JobId>> order;
};

TEST_F(SharingTest, PriorityThenSubmittersThenJobs) {
  hire(4);
  const JobId ann1 = submit("ann"), ann2 = submit("ann"), ann3 = submit("ann"), bob = submit("bob");
  costs[ann3] = 6;  // time counts, not tiles
  for (int i = 0; i < 150; ++i) turn();
  const double all = served[ann1] + served[ann2] + served[ann3] + served[bob];
  EXPECT_NEAR(served[bob] / all, 0.5, 0.03);
  for (const JobId& job : {ann1, ann2, ann3}) EXPECT_NEAR(served[job] / all, 1 / 6.0, 0.03) << job.value;
  const double before = served[bob];
  const JobId urgent = submit("ann", 1);
  for (int i = 0; i < 5; ++i) turn();
  EXPECT_EQ(served[urgent], 40) << "the urgent one waits for nobody";
  EXPECT_EQ(served[bob], before);
}

/// The simulated clock is the seconds since 1970 here.
class DeadlineTest : public SharingTest {
 protected:
  static FarmOptions dated() {
    FarmOptions options = fake_options();
    options.unix_offset = 0;
    return options;
  }
  DeadlineTest() : SharingTest(dated()) {}
  JobId submit_by(const std::string& submitter, double seconds, int64_t spp) {
    JobRequest request = small_job(64, 64, spp, Integrator::kPt);
    request.submitter = submitter;
    if (seconds > 0) request.deadline = clock.now() + seconds;
    return farm.submit(request);
  }
};

TEST_F(DeadlineTest, RaisesAJobThatWouldMissWithinItsSubmittersShare) {
  hire(4);
  const JobId bob = submit("bob");
  const JobId ann1 = submit_by("ann", 0, kMaxSpp), ann2 = submit_by("ann", 0, kMaxSpp);
  for (int i = 0; i < 40; ++i) turn();
  // At a third of half the farm it would take far too long; with all of ann's share it is just in time.
  const JobId urgent = submit_by("ann", 60, kMaxSpp);
  served.clear();
  for (int i = 0; i < 40; ++i) turn();
  const double all = served[bob] + served[ann1] + served[ann2] + served[urgent];
  EXPECT_NEAR(served[bob] / all, 0.5, 0.05) << "others keep their share";
  EXPECT_GT(served[urgent] / all, 0.4);
  EXPECT_THAT(farm.job(urgent).message, ::testing::HasSubstr("after its deadline"));
  clock.advance(30);
  EXPECT_THAT(farm.job(urgent).message, ::testing::HasSubstr("its deadline has passed"));
}

TEST_F(DeadlineTest, AJobInTimeIsNotRaised) {
  hire(4);
  const JobId other = submit_by("ann", 0, kMaxSpp), easy = submit_by("ann", 1e6, 4096);
  for (int i = 0; i < 20; ++i) turn();
  served.clear();
  for (int i = 0; i < 60; ++i) turn();
  EXPECT_NEAR(served[easy] / (served[easy] + served[other]), 0.5, 0.1);
}

TEST_F(SharingTest, ASmallJobBehindALongOneBeginsAtOnceAndEndsSoon) {
  hire(3);
  const JobId big = submit("ann");
  for (int i = 0; i < 200; ++i) turn();
  const JobId small = submit("ann", 0, 8);
  EXPECT_EQ(farm.lease(workers[0]).value().job, small) << "the next lease of anybody";
  farm.job(small);
  int turns = 0;
  while (farm.job(small).state != JobState::kDone && turns < 100) {
    turn();
    ++turns;
  }
  EXPECT_EQ(farm.job(small).state, JobState::kDone);
  EXPECT_LT(turns, 20);
  EXPECT_EQ(farm.job(big).state, JobState::kRunning);
}

TEST_F(SharingTest, WorkersStayWithAJobForARun) {
  hire(2);
  for (int i = 0; i < 6; ++i) submit("ann");
  for (int i = 0; i < 240; ++i) turn();
  for (const auto& [worker, jobs] : order) {
    int changes = 0;
    for (size_t i = 1; i < jobs.size(); ++i) changes += jobs[i] != jobs[i - 1];
    EXPECT_LT(changes, 240 / 8 + 12);
    EXPECT_GT(changes, 10) << "but they do change";
  }
  for (const auto& [job, seconds] : served) EXPECT_NEAR(seconds, 960 / 6.0, 34) << job.value;
}

TEST_F(SharingTest, WhoIsAloneGetsAll) {
  hire(2);
  const JobId job = submit("ann");
  for (int i = 0; i < 10; ++i) turn();
  EXPECT_EQ(served[job], 40);
  farm.pause(job);
  turn();
  EXPECT_EQ(served[job], 40);
  const JobId other = submit("bob");
  for (int i = 0; i < 100; ++i) turn();
  farm.resume(job);
  for (int i = 0; i < 100; ++i) turn();
  EXPECT_NEAR(served[job] - 40, 200, 40) << "a pause is not saved up";
  EXPECT_NEAR(served[other], 600, 40);
}

/// Four workers in turn render the job to its end, at `thread_rate` samples per second and thread.
void render_by_four_workers(Farm& farm, const JobId& job, double thread_rate) {
  std::vector<WorkerId> workers;
  for (int i = 0; i < 4; ++i) workers.push_back(farm.register_worker(registration()));
  for (bool any = true; any;) {
    any = false;
    for (const WorkerId& worker : workers) {
      const auto grant = farm.lease(worker);
      if (!grant) continue;
      any = true;
      const double samples = 1024.0 * static_cast<double>(grant->tile.samples() * grant->tile.cells.count());
      farm.commit(worker, {job, grant->tile_id, grant->attempt}, fake_bytes(*grant, samples / thread_rate));
    }
  }
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
}

TEST(Ingest, TilesGrowDeeperUntilTheirCommitsFit) {
  constexpr int64_t kSpp = 8192;  // a tile is as deep as a run of one replicate, which are short at first
  const auto bytes_per_sample = [](double limit) {
    FakeClock clock;
    FarmOptions options = fake_options();
    options.ingest_bytes_per_second = limit;
    Farm farm(std::make_unique<MemoryJobStore>(), clock, options);
    const JobRequest request = small_job(64, 64, kSpp, Integrator::kPt);
    const JobId job = farm.submit(request);
    render_by_four_workers(farm, job, 50000);
    EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings))) << "whatever the tiles";
    return static_cast<double>(farm.stats().commit_bytes) / (64.0 * 64 * kSpp);
  };
  // Four workers of two threads render 400,000 samples a second.
  const double free = bytes_per_sample(0), limited = bytes_per_sample(20e3);
  EXPECT_GT(free * 400e3, 60e3);
  EXPECT_LT(limited * 400e3, 40e3) << "the first rounds are shallow";
}

TEST(CommitRate, TilesTakeAsLongAsItAllowsAllWorkersTogether) {
  const auto commits = [](double rate) {
    FakeClock clock;
    FarmOptions options = fake_options();
    options.target_tile_seconds = 1;
    options.commits_per_second = rate;
    Farm farm(std::make_unique<MemoryJobStore>(), clock, options);
    const JobId job = farm.submit(small_job(256, 256, 128, Integrator::kPt));
    render_by_four_workers(farm, job, 25000);
    return static_cast<double>(farm.job(job).tiles_committed);
  };
  // Workers of two threads render 50,000 samples a second: 168 tiles of a second. One tile a second of all
  // four makes them take four seconds.
  const double free = commits(0), plenty = commits(1000), limited = commits(1);
  EXPECT_EQ(plenty, free) << "a limit that is not met changes nothing";
  EXPECT_LT(limited, 0.6 * free);
}

FarmOptions tight_memory() {
  FarmOptions options = fake_options();
  options.film_memory_bytes = 3.5 * film_bytes(small_settings(64, 64, kMaxSpp, Integrator::kPt));
  return options;
}

class TightSharingTest : public SharingTest {
 protected:
  TightSharingTest() : SharingTest(tight_memory()) {}
};

TEST_F(TightSharingTest, FilmsTakeTurnsInMemory) {
  hire(4);
  std::vector<JobId> jobs;
  for (int i = 0; i < 12; ++i) jobs.push_back(submit("ann"));
  for (int i = 0; i < 400; ++i) turn();
  EXPECT_LT(farm.stats().film_loads, 400u) << "of 1600 commits";
  EXPECT_GT(farm.stats().film_loads, 12u);
  EXPECT_LE(farm.stats().film_bytes, tight_memory().film_memory_bytes);
  for (const JobId& job : jobs) EXPECT_NEAR(served[job], 3200 / 12.0, 120) << "and all get on: " << job.value;
}

TEST_F(TightSharingTest, NobodyIdlesForTheSakeOfFilms) {
  hire(2);  // nobody holds more than four tiles
  for (int i = 0; i < 5; ++i) {
    JobRequest request = small_job(32, 32, 1, Integrator::kPt);
    farm.submit(request);
  }
  std::vector<JobId> leased;
  for (int tiles = 0; const auto grant = farm.lease(workers[static_cast<size_t>(tiles / 4)]); ++tiles)
    leased.push_back(grant->job);
  std::sort(leased.begin(), leased.end());
  EXPECT_EQ(std::unique(leased.begin(), leased.end()) - leased.begin(), 5);
}

}  // namespace
}  // namespace lightmill
