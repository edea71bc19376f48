// Workers that speak the protocol and deliver nothing: they hold leases, fail, hand back and lie about
// scenes. Honest workers end every job all the same.
#include <vector>

#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

class HostileHolders : public FarmFixture {
 protected:
  explicit HostileHolders(const FarmOptions& options = fake_options()) : FarmFixture(options) {}

  WorkerId join_with(uint64_t memory_bytes, int threads = 2) {
    WorkerRegistration who = registration();
    who.memory_bytes = memory_bytes;
    who.threads = threads;
    return farm.register_worker(who);
  }
  /// Worker that has delivered a job.
  WorkerId join_and_deliver() {
    const WorkerId worker = join();
    const JobId job = farm.submit(small_job(32, 32, 1));
    EXPECT_GT(work(farm, worker), 0);
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
    return worker;
  }
  std::string state_of(const WorkerId& id) {
    for (const WorkerStatus& worker : farm.workers()) {
      if (worker.id == id) return worker.state;
    }
    return "unknown";
  }
  /// Seconds until `honest` has done the job, who asks ten times a second; what others hold they renew.
  double seconds_to_finish(const JobId& job, const WorkerId& honest, double most = 600) {
    const double begin = clock.now();
    while (farm.job(job).state != JobState::kDone && clock.now() < begin + most) {
      for (const auto& [worker, lease] : held) farm.renew(worker, {lease});
      farm.tick();
      work(farm, honest);
      clock.advance(0.1);
    }
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
    return clock.now() - begin;
  }
  /// The worker takes all that it gets, to keep it.
  size_t grab(const WorkerId& worker) {
    const size_t before = held.size();
    while (const auto grant = farm.lease(worker)) held.emplace_back(worker, key(*grant));
    return held.size() - before;
  }
  std::vector<std::pair<WorkerId, LeaseKey>> held;
};

TEST_F(HostileHolders, NobodyHoldsMoreThanAFewTiles) {
  const JobId job = farm.submit(small_job(256, 256, 1 << 20));
  const WorkerId few = join_with(0, 4), many = join_with(0, 4096);
  EXPECT_EQ(grab(few), 4u);
  EXPECT_EQ(grab(many), 4u) << "a number of threads is but a claim";
  EXPECT_EQ(commit(many, farm.lease(join()).value()), CommitResult::kStale);
  for (const auto& [worker, lease] : std::vector(held)) farm.hand_back(worker, lease);
  const LeaseGrant grant = farm.lease(many).value();
  EXPECT_EQ(commit(many, grant), CommitResult::kAccepted);
  EXPECT_EQ(grab(many), 64u);
  EXPECT_LT(farm.tiles(job).size(), 5000u);
}

TEST_F(HostileHolders, AHugeJobIsNotLaidOut) {
  const JobId job = farm.submit(small_job(1024, 1024, 1 << 20, Integrator::kPt));
  for (int i = 0; i < 200; ++i) grab(join());
  EXPECT_EQ(held.size(), 800u);
  EXPECT_LT(farm.tiles(job).size(), 5000u);
}

TEST_F(HostileHolders, APilotThatIsHeldIsRunByAnother) {
  const JobId job = farm.submit(small_job(64, 64, 1, Integrator::kAuto));
  const WorkerId hostile = join(), honest = join();
  EXPECT_EQ(grab(hostile), 1u);
  EXPECT_LT(seconds_to_finish(job, honest), 4);
}

TEST_F(HostileHolders, HoweverManyHoldIt) {
  const JobId job = farm.submit(small_job(64, 64, 1, Integrator::kAuto));
  for (int i = 0; i < 20; ++i) {
    for (int wait = 0; wait < 40 && held.size() == static_cast<size_t>(i); ++wait) {
      clock.advance(0.1);
      for (const auto& [worker, lease] : held) farm.renew(worker, {lease});
      grab(join());
    }
    ASSERT_EQ(held.size(), static_cast<size_t>(i) + 1) << "another one may join every second";
  }
  EXPECT_LT(seconds_to_finish(job, join()), 4);
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(after_pilot(farm.job(job).settings))));
}

TEST_F(HostileHolders, EachOfManyRacersMayWin) {
  for (size_t winner = 0; winner < 5; ++winner) {
    held.clear();
    const JobId job = farm.submit(small_job(32, 32, 1));
    std::vector<LeaseGrant> racers;
    std::vector<WorkerId> workers;
    for (int wait = 0; racers.size() < 5 && wait < 1000; ++wait) {
      const WorkerId worker = join();
      if (const auto grant = farm.lease(worker)) {
        racers.push_back(*grant);
        workers.push_back(worker);
        held.emplace_back(worker, key(*grant));
      }
      for (const auto& [holder, lease] : held) farm.renew(holder, {lease});
      clock.advance(0.5);
    }
    ASSERT_EQ(racers.size(), 5u);
    EXPECT_EQ(commit(workers[winner], racers[winner]), CommitResult::kAccepted);
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
    EXPECT_EQ(farm.tiles(job).at(0).worker, workers[winner]);
    for (size_t i = 0; i < racers.size(); ++i) {
      EXPECT_EQ(commit(workers[i], racers[i]),
                i == winner ? CommitResult::kAlreadyCommitted : CommitResult::kStale);
      EXPECT_EQ(state_of(workers[i]), "idle");
    }
  }
}

TEST_F(HostileHolders, RacersMayLeaveInAnyOrder) {
  const JobId job = farm.submit(small_job(32, 32, 1));
  std::vector<std::pair<WorkerId, LeaseGrant>> racers;
  for (int wait = 0; racers.size() < 4 && wait < 1000; ++wait) {
    const WorkerId worker = join();
    if (const auto grant = farm.lease(worker)) racers.emplace_back(worker, *grant);
    for (const auto& [holder, grant] : racers) farm.renew(holder, {key(grant)});
    clock.advance(0.5);
  }
  ASSERT_EQ(racers.size(), 4u);
  for (const size_t leaver : {1u, 3u, 0u}) {
    farm.hand_back(racers[leaver].first, key(racers[leaver].second));
    EXPECT_EQ(commit(racers[leaver].first, racers[leaver].second), CommitResult::kStale);
  }
  EXPECT_EQ(commit(racers[2].first, racers[2].second), CommitResult::kAccepted);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
}

TEST_F(HostileHolders, AFarmThatNeverIdlesRacesThemToo) {
  const WorkerId honest = join_and_deliver(), hostile = join();
  const JobId stuck = farm.submit(small_job(32, 32, 1, Integrator::kAuto));
  EXPECT_EQ(grab(hostile), 1u);
  const JobId endless = farm.submit(small_job(64, 64, 1 << 20));
  for (int i = 0; i < 200 && farm.job(stuck).state != JobState::kDone; ++i) {
    farm.renew(hostile, {held[0].second});
    EXPECT_EQ(commit(honest, farm.lease(honest).value()), CommitResult::kAccepted);
    clock.advance(0.1);
  }
  EXPECT_EQ(farm.job(stuck).state, JobState::kDone);
  EXPECT_EQ(farm.job(endless).state, JobState::kRunning);
}

TEST_F(HostileHolders, ALeaseEndsWhenOthersNeedItsTile) {
  // The tile is of an early round, so that nobody races for it: the job goes on with later ones.
  const JobId job = farm.submit(small_job(64, 64, 1 << 20));
  const WorkerId hostile = join(), honest = join();
  grab(hostile);
  for (int i = 0; i < 600; ++i) {
    for (const auto& [worker, lease] : held) farm.renew(worker, {lease});
    if (i % 10 == 0) commit(honest, farm.lease(honest).value());
    farm.tick();
    clock.advance(0.1);
  }
  EXPECT_EQ(farm.renew(hostile, {held[0].second}).size(), 1u);
  EXPECT_EQ(state_of(hostile), "benched") << "it has delivered nothing";
  ASSERT_FALSE(farm.curve(job).points.empty());
  EXPECT_GT(farm.curve(job).points.back().spp, 1) << "all pixels have the samples of early rounds";
}

TEST_F(HostileHolders, WhoIsAloneMayTakeAnyTime) {
  const JobId job = farm.submit(small_job(32, 32, 1, Integrator::kAuto));
  const WorkerId slow = join();
  const LeaseGrant pilot = farm.lease(slow).value();
  for (int i = 0; i < 1000; ++i) {
    clock.advance(5);
    farm.tick();
    ASSERT_TRUE(farm.renew(slow, {key(pilot)}).empty());
  }
  EXPECT_EQ(commit(slow, pilot), CommitResult::kAccepted);
  work(farm, slow);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
}

TEST_F(HostileHolders, AHeavyTileIsRenderedInTheEnd) {
  // Two honest workers that need ten minutes for it, of which nobody knows beforehand.
  const JobId job = farm.submit(small_job(32, 32, 1));
  const WorkerId workers[] = {join(), join()};
  std::optional<LeaseGrant> grants[2];
  for (int i = 0; i < 7200 && farm.job(job).state != JobState::kDone; ++i) {
    clock.advance(1);
    farm.tick();
    for (int w = 0; w < 2; ++w) {
      if (grants[w] && !farm.renew(workers[w], {key(*grants[w])}).empty()) grants[w].reset();
      if (!grants[w]) {
        grants[w] = farm.lease(workers[w]);
        if (grants[w]) held.emplace_back(WorkerId{std::to_string(clock.now())}, key(*grants[w]));
      } else if (clock.now() -
                     std::stod(std::find_if(held.begin(), held.end(),
                                            [&](const auto& h) { return h.second == key(*grants[w]); })
                                   ->first.value) >=
                 600) {
        EXPECT_EQ(commit(workers[w], *grants[w], 600), CommitResult::kAccepted);
        break;
      }
    }
  }
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
}

TEST_F(HostileHolders, TilesThatAreHandedBackForEverFailNoJob) {
  const JobId job = farm.submit(small_job(32, 32, 1));
  for (int i = 0; i < 300; ++i) {
    const WorkerId hostile = join();
    farm.hand_back(hostile, key(farm.lease(hostile).value()));
  }
  const WorkerId hostile = join();
  int tiles = 0;
  for (; const auto grant = farm.lease(hostile); ++tiles) farm.hand_back(hostile, key(*grant));
  EXPECT_EQ(tiles, 16);
  EXPECT_EQ(state_of(hostile), "benched");
  work(farm, join());
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
}

TEST_F(HostileHolders, FailuresOfStrangersFailNoJobWhileThereIsAnybodyToTry) {
  const WorkerId honest = join_and_deliver();
  const JobId job = farm.submit(small_job(32, 32, 1));
  for (int i = 0; i < 30; ++i) {
    const WorkerId hostile = join();
    farm.fail(hostile, key(farm.lease(hostile).value()), "no reason at all");
    ASSERT_EQ(farm.job(job).state, JobState::kRunning) << i;
  }
  work(farm, honest);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
}

TEST_F(HostileHolders, ASceneFaultFailsItsJobAtOnceAndNobodyElseFeelsIt) {
  const WorkerId a = join_and_deliver(), b = join_and_deliver(), c = join_and_deliver();
  const JobId bad = farm.submit(small_job(256, 256, 64)), good = farm.submit(small_job(32, 32, 1));
  farm.fail(a, key(farm.lease(a).value()), "bad.pbrt:7: no such shape", FailureKind::kScene);
  EXPECT_EQ(farm.job(bad).state, JobState::kRunning) << "the worker may be wrong";
  const LeaseGrant next = farm.lease(a).value();
  EXPECT_EQ(next.job, good) << "it does not try that scene again";
  EXPECT_EQ(commit(a, next), CommitResult::kAccepted);
  farm.fail(b, key(farm.lease(b).value()), "bad.pbrt:7: no such shape", FailureKind::kScene);
  EXPECT_EQ(farm.job(bad).state, JobState::kFailed);
  EXPECT_THAT(farm.job(bad).message, HasSubstr("the scene can't be rendered"));
  EXPECT_THAT(farm.job(bad).message, HasSubstr("bad.pbrt:7: no such shape"));
  for (const WorkerId& worker : {a, b, c}) EXPECT_EQ(state_of(worker), "idle");
  EXPECT_EQ(farm.job(good).state, JobState::kDone);
}

TEST_F(HostileHolders, ALoneWorkersSceneFaultIsEnough) {
  const JobId bad = farm.submit(small_job(256, 256, 64, Integrator::kAuto));
  const WorkerId only = join();
  farm.fail(only, key(farm.lease(only).value()), "no camera", FailureKind::kScene);
  EXPECT_EQ(farm.job(bad).state, JobState::kFailed);
}

TEST_F(HostileHolders, WhoLiesAboutAScenePaysForIt) {
  const WorkerId honest = join_and_deliver();
  const WorkerId liar = join();
  for (int i = 0; i < 8; ++i) {
    const JobId job = farm.submit(small_job(32, 32, 1));
    farm.fail(liar, key(farm.lease(liar).value()), "no camera", FailureKind::kScene);
    EXPECT_EQ(farm.job(job).state, JobState::kRunning);
    work(farm, honest);
    EXPECT_EQ(farm.job(job).state, JobState::kDone);
  }
  EXPECT_EQ(state_of(liar), "benched");
}

TEST_F(HostileHolders, AJobThatNeedsMuchMemoryGoesToALargerWorker) {
  const WorkerId small = join_with(1 << 20), same = join_with(1 << 20), large = join_with(1 << 30);
  farm.submit(small_job(32, 32, 1));
  work(farm, small);  // so that it is no mere name
  const JobId job = farm.submit(small_job(128, 128, 1));
  for (int i = 0; i < 2; ++i)
    farm.fail(small, key(farm.lease(small).value()), "out of memory", FailureKind::kMemory);
  EXPECT_FALSE(farm.lease(small));
  EXPECT_FALSE(farm.lease(same)) << "it has no more";
  EXPECT_EQ(farm.job(job).state, JobState::kRunning);
  EXPECT_EQ(state_of(small), "idle") << "nobody is to blame";
  farm.drain(large);
  EXPECT_THAT(farm.job(job).message, HasSubstr("waits for a worker with more than 1 MiB of memory"));
  const WorkerId larger = join_with(1 << 30);
  work(farm, larger);
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
}

TEST_F(HostileHolders, WhereNobodyHasTheMemoryTheJobSaysSo) {
  const WorkerId small = join_with(1 << 20);
  const JobId job = farm.submit(small_job(128, 128, 1));
  for (int i = 0; i < 2; ++i)
    farm.fail(small, key(farm.lease(small).value()), "it takes more than 1 MiB", FailureKind::kMemory);
  EXPECT_EQ(farm.job(job).state, JobState::kFailed);
  EXPECT_THAT(farm.job(job).message, HasSubstr("no worker here has enough memory"));
  EXPECT_THAT(farm.job(job).message, HasSubstr("it takes more than 1 MiB"));
}

TEST_F(HostileHolders, ATileThatKillsItsWorkersFailsTheJob) {
  const JobId job = farm.submit(small_job(32, 32, 1));
  for (int i = 0; i < 50; ++i) {
    ASSERT_EQ(is_final(farm.job(job).state), false) << i;
    const auto grant = farm.lease(join());
    clock.advance(grant ? 11 : 0.1);
    farm.tick();
  }
  EXPECT_EQ(farm.job(job).state, JobState::kFailed);
  EXPECT_THAT(farm.job(job).message, HasSubstr("never came back"));
}

}  // namespace
}  // namespace lightmill
