// Spot checks: a worker whose pixels are wrong is found out, and nothing of it stays in the image.
#include <map>
#include <set>
#include <vector>

#include "coordinator/farm/check_table.h"
#include "coordinator/merge/store_check.h"
#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

TEST(CheckTable, TwoAgainstOneDecide) {
  TileRecord tile;
  tile.id = TileId{3};
  tile.state = TileState::kCommitted;
  tile.attempt = 2;
  tile.worker = WorkerId{"a"};
  tile.digest = "1";
  const auto vote = [&](const std::vector<std::string>& digests) {
    CheckTable table;
    table.add(tile);
    EXPECT_FALSE(table.next(WorkerId{"a"})) << "nobody checks itself";
    CheckTable::Outcome outcome;
    const char* names[] = {"b", "c"};
    for (size_t i = 0; i < digests.size(); ++i) {
      const WorkerId worker{names[i]};
      EXPECT_EQ(table.next(worker), TileId{3});
      EXPECT_EQ(table.lease(TileId{3}, worker, 10), static_cast<int64_t>(3 + i)) << "attempts go on";
      EXPECT_FALSE(table.next(WorkerId{"x"})) << "one at a time";
      outcome = table.vote(TileId{3}, digests[i]);
      EXPECT_FALSE(table.next(worker));
    }
    return outcome;
  };
  EXPECT_TRUE(vote({"1"}).decided && vote({"1"}).first_is_right);
  EXPECT_FALSE(vote({"2"}).decided);
  EXPECT_EQ(vote({"2", "2"}).liar, WorkerId{"a"});
  EXPECT_FALSE(vote({"2", "2"}).first_is_right);
  EXPECT_EQ(vote({"2", "1"}).liar, WorkerId{"b"});
  EXPECT_TRUE(vote({"2", "1"}).first_is_right);
  EXPECT_TRUE(vote({"2", "3"}).hopeless);
}

constexpr double kTileSeconds = 2;  // of both threads: tiles stay small

FarmOptions checking(int one_in) {
  FarmOptions options = fake_options();
  options.spot_check = one_in;
  options.spot_check_seed = 1;
  options.checkpoint_bytes = 20e3;  // snapshots contain lies, too
  return options;
}

/// Good in every count, wrong in a pixel and in what was dropped.
std::string lie(const LeaseGrant& grant, Units by = 1) {
  Partial partial = fake_partial(grant.tile, grant.settings, kTileSeconds);
  partial.camera[0].c[0] += by << 40;
  partial.dropped.add(DropKind::kCapped, 1);
  return encode_partial(partial);
}

class CheckTest : public ::testing::Test {
 protected:
  void start(int one_in) {
    farm.reset();
    FarmOptions options = checking(one_in);
    options.quarantine = [this](const LeaseKey&, const WorkerId&, const std::string& reason,
                                const std::string& bytes) { evidence.emplace_back(reason, bytes); };
    options.log = [this](const std::string& line) { logged += line + "\n"; };
    farm = std::make_unique<Farm>(std::make_unique<WatchedStore>(store,
                                                                 [this](int write) {
                                                                   if (broken) broken(write);
                                                                 }),
                                  clock, options);
  }
  WorkerId join() { return farm->register_worker(registration()); }
  /// Everybody leases and commits in turn until nobody gets anything.
  void run(const std::vector<WorkerId>& workers, const std::map<WorkerId, Units>& liars, int turns = 100000) {
    for (int idle = 0; idle < static_cast<int>(workers.size()) && turns > 0;) {
      for (const WorkerId& worker : workers) {
        const auto grant = farm->lease(worker);
        idle = grant ? 0 : idle + 1;
        if (!grant || --turns < 0) continue;
        leased[{grant->job, grant->tile_id}].insert(worker);
        const std::string bytes =
            liars.contains(worker) ? lie(*grant, liars.at(worker)) : fake_bytes(*grant, kTileSeconds);
        EXPECT_EQ(farm->commit(worker, {grant->job, grant->tile_id, grant->attempt}, bytes),
                  CommitResult::kAccepted);
      }
      farm->tick();
    }
  }
  void expect_good(const JobId& job) {
    EXPECT_EQ(farm->job(job).state, JobState::kDone) << farm->job(job).message;
    EXPECT_EQ(farm->job(job).packets_done, farm->job(job).packets_total);
    EXPECT_EQ(farm->job(job).spp, static_cast<double>(farm->job(job).settings.spp));
    EXPECT_TRUE(same_pixels(farm->image(job), fake_image(farm->job(job).settings)));
    EXPECT_EQ(farm->job(job).dropped, DroppedShares{});
    EXPECT_EQ(check_store(store), std::vector<std::string>());
  }
  std::string state_of(const WorkerId& id) {
    for (const WorkerStatus& worker : farm->workers()) {
      if (worker.id == id) return worker.state;
    }
    return "";
  }
  FakeClock clock;
  MemoryJobStore store;
  std::function<void(int)> broken;
  std::vector<std::pair<std::string, std::string>> evidence;
  std::string logged;
  std::map<std::pair<JobId, TileId>, std::set<WorkerId>> leased;
  std::unique_ptr<Farm> farm;
};

TEST_F(CheckTest, HonestWorkersCheckEachOther) {
  start(1);
  const JobId job = farm->submit(small_job(96, 96, 20));
  run({join(), join()}, {});
  expect_good(job);
  const uint64_t tiles = farm->tiles(job).size();
  EXPECT_EQ(farm->stats().checks, tiles);
  for (const auto& [tile, workers] : leased) EXPECT_EQ(workers.size(), 2u);
  EXPECT_TRUE(evidence.empty());
  EXPECT_TRUE(store.kept_partials(job).empty()) << "they go with the job's end";
}

TEST_F(CheckTest, ALiarIsFoundAndAllOfItsTilesAreRenderedAgain) {
  start(1);
  const JobId job = farm->submit(small_job(96, 96, 20));
  const WorkerId ann = join(), bob = join(), liar = join();
  run({ann, bob, liar}, {{liar, 1}});
  expect_good(job);
  EXPECT_EQ(state_of(liar), "benched");
  EXPECT_EQ(farm->stats().liars, 1u);
  EXPECT_EQ(farm->stats().refusals.at("spot_check"), 1u);
  for (const TileStatus& tile : farm->tiles(job)) EXPECT_NE(tile.worker, liar);
  ASSERT_GE(evidence.size(), 2u);
  EXPECT_THAT(evidence[0].first, HasSubstr("spot check of job " + job.value));
  EXPECT_NE(evidence[0].second, evidence[1].second) << "both partials are kept";
  EXPECT_THAT(logged, HasSubstr("worker " + liar.value + " rendered job"));
}

TEST_F(CheckTest, OneInManyIsEnoughInTheLongRun) {
  start(10);
  const JobId job = farm->submit(small_job(160, 160, 200, Integrator::kPt));
  const WorkerId ann = join(), bob = join(), liar = join();
  run({ann, bob, liar}, {{liar, 5}});
  // More than 300 tiles, a third by the liar: it gets away with probability 0.9^100 < 3e-5.
  ASSERT_GT(farm->tiles(job).size(), 300u);
  expect_good(job);
  EXPECT_EQ(farm->stats().liars, 1u);
  EXPECT_LT(farm->stats().checks, farm->tiles(job).size() / 2) << "not every tile is rendered twice";
  EXPECT_GT(farm->stats().tiles_taken_back, 0u);
}

TEST_F(CheckTest, TwoWhoDisagreeWaitForAThird) {
  start(1);
  const JobId job = farm->submit(small_job(64, 64, 2));
  const WorkerId honest = join(), liar = join();
  run({honest, liar}, {{liar, 1}}, 40);
  for (int i = 0; i < 200; ++i)
    clock.advance(1), farm->renew(honest, {}), farm->renew(liar, {}), farm->tick();
  EXPECT_EQ(farm->job(job).state, JobState::kRunning) << "a doubtful image is never done";
  EXPECT_THAT(farm->job(job).message, HasSubstr("differently: a third one has to decide"));
  const WorkerId third = join();
  run({third, honest}, {});
  expect_good(job);
  EXPECT_EQ(state_of(liar), "benched");
}

TEST_F(CheckTest, ThreeResultsFailTheJob) {
  start(1);
  const JobId job = farm->submit(small_job(64, 64, 2));
  const WorkerId ann = join(), bob = join(), eve = join();
  run({ann, bob, eve}, {{bob, 1}, {eve, 2}}, 60);
  EXPECT_EQ(farm->job(job).state, JobState::kFailed);
  EXPECT_THAT(farm->job(job).message, HasSubstr("came out differently on workers"));
}

TEST_F(CheckTest, ALoneWorkerIsNotWaitedForForEver) {
  start(1);
  const JobId job = farm->submit(small_job(64, 64, 2));
  const WorkerId alone = join();
  run({alone}, {});
  EXPECT_EQ(farm->job(job).state, JobState::kRunning);
  EXPECT_THAT(farm->job(job).message, HasSubstr("spot checks"));
  for (int i = 0; i < 32; ++i) clock.advance(1), farm->renew(alone, {}), farm->tick();
  expect_good(job);
  EXPECT_THAT(logged, HasSubstr("stays unchecked: no second worker"));
}

TEST_F(CheckTest, AJobThatBeganWithoutChecksIsRenderedAgainAsAWhole) {
  start(0);
  const JobId job = farm->submit(small_job(96, 96, 20));
  const WorkerId old_liar = join();
  run({old_liar}, {{old_liar, 3}}, 15);
  start(1);  // what it did is in the snapshot, its partials are gone
  const WorkerId ann = join(), bob = join(), liar = join();
  run({ann, bob, liar}, {{liar, 1}});
  expect_good(job);
  EXPECT_EQ(farm->stats().liars, 1u);
}

TEST_F(CheckTest, ChecksAndConvictionsSurviveARestartAndABrokenDisk) {
  start(1);
  const JobId job = farm->submit(small_job(96, 96, 20));
  const WorkerId ann = join(), liar = join();
  run({ann, liar}, {{liar, 1}}, 25);
  start(1);
  EXPECT_EQ(farm->job(job).state, JobState::kRunning);
  const WorkerId bob = join(), eve = join(), other_liar = join();
  bool breaks = true;
  broken = [&](int) {
    if (breaks && farm && logged.find("rendered again") != std::string::npos) {
      breaks = false;
      throw StoreError("disk full");
    }
  };
  std::map<LeaseKey, std::pair<WorkerId, std::string>> unanswered;
  for (int turn = 0; turn < 3000 && farm->job(job).state != JobState::kDone; ++turn) {
    for (const WorkerId& worker : {bob, eve, other_liar}) {
      try {
        if (const auto grant = farm->lease(worker)) {
          unanswered[{grant->job, grant->tile_id, grant->attempt}] = {
              worker, worker == other_liar ? lie(*grant) : fake_bytes(*grant)};
        }
        for (auto it = unanswered.begin(); it != unanswered.end();) {
          farm->commit(it->second.first, it->first, it->second.second);
          it = unanswered.erase(it);
        }
      } catch (const StoreError&) {
        clock.advance(3);
      }
      farm->tick();
    }
    clock.advance(1);
    for (const WorkerId& worker : {bob, eve, other_liar}) farm->renew(worker, {});
  }
  EXPECT_FALSE(breaks) << "the disk broke at the wrong moment";
  expect_good(job);
}

TEST_F(CheckTest, WhoeverFailsACheckIsBlamedAndAnotherTakesIt) {
  start(1);
  const JobId job = farm->submit(small_job(32, 32, 1));
  const WorkerId ann = join(), bob = join(), eve = join();
  const LeaseGrant grant = *farm->lease(ann);
  EXPECT_EQ(farm->commit(ann, {job, grant.tile_id, 1}, fake_bytes(grant)), CommitResult::kAccepted);
  LeaseGrant check = *farm->lease(bob);
  EXPECT_EQ(check.tile_id, grant.tile_id);
  EXPECT_EQ(check.attempt, 2);
  EXPECT_FALSE(farm->lease(eve));
  farm->fail(bob, {job, check.tile_id, check.attempt}, "no memory");
  EXPECT_EQ(farm->stats().failures, 1u);
  check = *farm->lease(eve);
  EXPECT_EQ(farm->commit(eve, {job, check.tile_id, check.attempt}, "rubbish"), CommitResult::kCorrupt);
  check = *farm->lease(bob);
  clock.advance(9);
  EXPECT_TRUE(farm->renew(bob, {{job, check.tile_id, check.attempt}}).empty());
  clock.advance(11);
  EXPECT_EQ(farm->renew(bob, {{job, check.tile_id, check.attempt}}).size(), 1u);
  check = *farm->lease(eve);
  EXPECT_EQ(farm->commit(eve, {job, check.tile_id, check.attempt}, fake_bytes(check)),
            CommitResult::kAccepted);
  expect_good(job);
  for (const WorkerId& worker : {ann, bob, eve}) EXPECT_NE(state_of(worker), "rendering");
}

}  // namespace
}  // namespace lightmill
