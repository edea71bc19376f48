// Workers of a farm: who may work on what, who is refused, lost or one too many. Time is simulated.
#include <algorithm>
#include <atomic>
#include <thread>

#include "coordinator/core/farm.h"
#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

using FarmWorkers = FarmFixture;

TEST_F(FarmWorkers, PoolsAndArithmeticClasses) {
  JobRequest request = small_job(64, 64, 4);
  request.pool = "gpu";
  const JobId job = farm.submit(request);
  EXPECT_THAT(farm.job(job).message, HasSubstr("none is connected"));
  const WorkerId plain = farm.register_worker(registration());
  EXPECT_FALSE(farm.lease(plain));
  EXPECT_THAT(farm.job(job).message, HasSubstr("pool \"gpu\""));
  const WorkerId a = farm.register_worker(registration("class-a", "gpu"));
  const WorkerId b = farm.register_worker(registration("class-b", "gpu"));
  EXPECT_EQ(commit(a, farm.lease(a).value()), CommitResult::kAccepted);
  EXPECT_FALSE(farm.lease(b)) << "the job belongs to the class of its first worker";
  farm.drain(a);
  EXPECT_FALSE(farm.lease(a));
  EXPECT_THAT(farm.job(job).message, HasSubstr("arithmetic class class-a"));
  const JobId other = farm.submit(small_job(64, 64, 4));
  EXPECT_EQ(farm.lease(b).value().job, other) << "it takes other jobs";
}

TEST_F(FarmWorkers, WorkersOfAnotherBuildOrSchemaAreRefusedWithASentence) {
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

TEST_F(FarmWorkers, JobsThatWaitSayWhoWasRefusedAndWhy) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  WorkerRegistration other = registration();
  other.host = "box\n1";
  other.build = "build-2";
  const auto refuse = [&] { error_of([&] { farm.register_worker(other); }); };
  for (int i = 0; i < 3; ++i) refuse();  // a service is started again and again
  EXPECT_EQ(
      farm.job(job).message,
      "waits for a worker: none is connected; that of host \"box?1\" was refused: worker of another build: "
      "it is \"build-2\", the coordinator is \"" +
          registration().build + "\"; install the same version on both");
  EXPECT_EQ(farm.workers().size(), 1u);
  other.host = "box2";
  other.build = std::string(1000, 'b');
  refuse();
  EXPECT_THAT(farm.job(job).message,
              HasSubstr("those of 2 hosts were refused, last of host \"box2\": worker of"));
  EXPECT_LT(farm.job(job).message.size(), 600u);
  farm.turned_away("the token is not known here");
  EXPECT_THAT(farm.job(job).message, HasSubstr("last of an unknown host: the token is not known here"));
  for (int i = 0; i < 100; ++i) {
    other.host = "box" + std::to_string(i);
    refuse();
  }
  EXPECT_EQ(farm.workers().size(), 32u) << "strangers take no more memory than this";
  EXPECT_EQ(farm.stats().refusals["worker_build"], 104u);
  clock.advance(601);
  EXPECT_EQ(farm.job(job).message, "waits for a worker: none is connected");
  EXPECT_TRUE(farm.workers().empty());
}

TEST_F(FarmWorkers, JobsThatWaitSayThatWorkersRestOrAreDrained) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  const WorkerId worker = join();
  farm.drain(worker);
  EXPECT_EQ(farm.job(job).message, "waits for a worker: those connected are being drained");
  const WorkerId sick = join();
  const JobId other = farm.submit(small_job(64, 64, 4));
  for (int i = 0; i < 100; ++i) {
    const auto grant = farm.lease(sick);
    if (!grant) break;
    farm.fail(sick, key(*grant), "no memory");
  }
  std::string message;
  for (const JobId& id : {job, other}) {
    if (farm.job(id).state != JobState::kFailed) message = farm.job(id).message;
  }
  EXPECT_EQ(message, "waits for a worker: of 2 connected 1 rest after failures");
}

TEST_F(FarmWorkers, WhoHoldsALeaseTellsWhatLightTheImageLacks) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  const WorkerId ann = join(), bob = join();
  const LeaseGrant lease = farm.lease(ann).value();
  const std::vector<std::string> lines = {"about a tenth", "and more"};
  farm.warn(bob, key(lease), {"what another says"});
  farm.warn(ann, {job, lease.tile_id, lease.attempt + 1}, {"of another attempt"});
  farm.warn(ann, {JobId{"j77"}, lease.tile_id, lease.attempt}, {"of no job"});
  EXPECT_TRUE(farm.job(job).missing_light.empty());
  farm.warn(ann, key(lease), lines);
  const JobStatus told = farm.job(job);
  EXPECT_EQ(told.missing_light, lines);
  farm.warn(ann, key(lease), lines);
  EXPECT_EQ(farm.job(job).version, told.version) << "nothing new";
  for (const auto& refused : {std::vector<std::string>{},
                              std::vector<std::string>(kMaxMissingLight + 1, "a"),
                              {std::string(kMaxNoteBytes + 1, 'a')},
                              {""}}) {
    EXPECT_THAT(error_of([&] { farm.warn(ann, key(lease), refused); }), HasSubstr("missing_light has 1 to"));
  }
  EXPECT_EQ(commit(ann, lease), CommitResult::kAccepted);
  EXPECT_EQ(farm.job(job).missing_light, lines);
}

TEST_F(FarmWorkers, WorkersAreLostAfterThreeLeaseTimes) {
  const WorkerId ann = farm.register_worker(registration());
  clock.advance(29);
  EXPECT_EQ(farm.workers()[0].state, "idle");
  clock.advance(2);
  EXPECT_EQ(farm.workers()[0].state, "lost");
  EXPECT_FALSE(farm.lease(ann));
  EXPECT_EQ(farm.workers()[0].state, "idle") << "it has come back";
}

TEST(FarmLimits, NoMoreWorkersThanAskedForUntilSomeAreLost) {
  FakeClock clock;
  FarmOptions options = fake_options();
  options.max_workers = 2;
  Farm farm(std::make_unique<MemoryJobStore>(), clock, options);
  for (int i = 0; i < 2; ++i) farm.lease(farm.register_worker(registration()));
  try {
    farm.register_worker(registration());
    FAIL() << "a third worker";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("--max-workers"));
  }
  clock.advance(1000);
  EXPECT_NO_THROW(farm.register_worker(registration())) << "those before are lost";
}

/// A full farm, and who may join it all the same.
class FullFarm : public FarmFixture {
 protected:
  static FarmOptions options() {
    FarmOptions options = fake_options();
    options.max_workers = 4;
    return options;
  }
  FullFarm() : FarmFixture(options()) {}
  WorkerId join(const std::string& owner = "ann", bool asks = true) {
    const WorkerId id = farm.register_worker(registration(), owner);
    clock.advance(0.1);
    if (asks) farm.lease(id);
    return id;
  }
  bool full(const std::string& owner = "ann") {
    return error_of([&] { join(owner); }) != "no error";
  }
  bool known(const WorkerId& id) {
    for (const WorkerStatus& worker : farm.workers()) {
      if (worker.id == id) return true;
    }
    return false;
  }
};

TEST_F(FullFarm, WhoNeverAskedForATileMakesRoomForOthers) {
  const WorkerId real = join();
  std::vector<WorkerId> fakes;
  for (int i = 0; i < 3; ++i) fakes.push_back(join("ann", false));
  const WorkerId second = join();
  EXPECT_FALSE(known(fakes[0])) << "the one that was silent longest";
  EXPECT_TRUE(known(fakes[1]));
  for (int i = 0; i < 100; ++i) join("ann", false);
  EXPECT_TRUE(known(real) && known(second)) << "however many come";
  join();
  join();
  EXPECT_TRUE(full()) << "four that ask are enough";
  EXPECT_EQ(farm.workers().size(), 4u);
  EXPECT_EQ(farm.stats().refusals["worker_limit"], 1u);
  EXPECT_THAT(error_of([&] { farm.lease(fakes[0]); }), HasSubstr("register again"));
}

TEST_F(FullFarm, OneTokensIdleWorkersDoNotKeepAnothersOut) {
  const JobId job = farm.submit(small_job(64, 64, 4));
  const WorkerId busy = farm.register_worker(registration(), "leaked");
  ASSERT_TRUE(farm.lease(busy));
  farm.pause(job);
  for (int i = 0; i < 3; ++i) join("leaked");
  EXPECT_TRUE(full("leaked"));
  const WorkerId first = join("bob"), second = join("bob");
  EXPECT_TRUE(full("bob")) << "as many as the other has";
  EXPECT_TRUE(full("leaked"));
  EXPECT_TRUE(known(busy) && known(first) && known(second));
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

TEST_F(FarmWorkers, ManyWorkersAtOnce) {
  const JobRequest request = small_job(128, 96, 64);
  const JobId job = farm.submit(request);
  std::vector<std::thread> threads;
  std::atomic<size_t> accepted{0};
  for (int i = 0; i < 6; ++i) {
    threads.emplace_back([&] {
      const WorkerId worker = farm.register_worker(registration());
      while (!is_final(farm.job(job).state)) {
        const auto grant = farm.lease(worker, 0.05);
        if (!grant) continue;
        // The last tiles may be raced for, as these workers seem to be of many speeds: one of two is late.
        const CommitResult result = commit(worker, *grant);
        EXPECT_TRUE(result == CommitResult::kAccepted || result == CommitResult::kStale);
        accepted += result == CommitResult::kAccepted;
        farm.image(job);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(farm.job(job).state, JobState::kDone);
  const std::vector<TileStatus> tiles = farm.tiles(job);
  EXPECT_EQ(accepted, static_cast<size_t>(std::count_if(tiles.begin(), tiles.end(), [](const TileStatus& t) {
              return t.state == "committed";
            })));
  EXPECT_TRUE(same_pixels(farm.image(job), fake_image(request.settings)));
}

}  // namespace
}  // namespace lightmill
