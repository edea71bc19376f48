// Why a job waits for its turn, and when that comes, against what the farm then does.
#include <map>
#include <set>
#include <vector>

#include "coordinator/farm/sharing/film_bytes.h"
#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

FarmOptions dated(FarmOptions options) {
  options.unix_offset = 0;  // the simulated clock is the seconds since 1970 here
  return options;
}

class WaitingTest : public FarmFixture {
 protected:
  explicit WaitingTest(const FarmOptions& options = fake_options()) : FarmFixture(dated(options)) {}
  JobId submit(const std::string& submitter, int priority = 0, int64_t spp = kMaxSpp, double time_s = 0) {
    JobRequest request = small_job(64, 64, spp, Integrator::kPt);
    request.submitter = submitter;
    request.priority = priority;
    request.settings.time_s = time_s;
    return farm.submit(request);
  }
  /// Every worker leases a tile, all take a second, and hand in, each after 2 seconds of processors unless
  /// `costs` says other. Returns the jobs that had tiles.
  std::set<JobId> turn() {
    std::vector<std::pair<WorkerId, LeaseGrant>> held;
    std::set<JobId> jobs;
    for (const WorkerId& worker : workers) {
      if (const auto grant = farm.lease(worker)) held.emplace_back(worker, *grant);
    }
    clock.advance(1);
    for (const auto& [worker, grant] : held) {
      EXPECT_EQ(commit(worker, grant, costs.contains(grant.job) ? costs.at(grant.job) : 2.0),
                CommitResult::kAccepted);
      jobs.insert(grant.job);
    }
    return jobs;
  }
  void turns(int count) {
    for (int i = 0; i < count; ++i) turn();
  }
  int turns_until(const JobId& job) {
    for (int i = 0; i < 1000; ++i) {
      if (turn().contains(job)) return i;
    }
    return -1;
  }
  void hire(int count) {
    for (int i = 0; i < count; ++i) workers.push_back(join());
  }
  std::vector<WorkerId> workers;
  std::map<JobId, double> costs;
};

TEST_F(WaitingTest, BehindOneOfHigherPriorityUntilThatIsDone) {
  hire(2);
  const JobId high = submit("ann", 5, 4096), low = submit("bob");
  turns(20);
  const JobStatus status = farm.job(low);
  EXPECT_EQ(status.state, JobState::kQueued);
  EXPECT_EQ(status.waiting, "waits behind job " + high.value + ", whose priority is higher (5, not 0)");
  EXPECT_EQ(status.message, status.waiting);
  EXPECT_EQ(status.waits_behind, high);
  ASSERT_GT(status.turn_seconds, 0);
  const int waited = turns_until(low);
  EXPECT_NEAR(status.turn_seconds, waited, 3 + 0.1 * waited);
  EXPECT_EQ(farm.job(low).waiting, "");
  EXPECT_LT(farm.job(low).turn_seconds, 0);
}

TEST_F(WaitingTest, ManyBeforeItAreCounted) {
  hire(1);
  const JobId first = submit("ann", 5, 2048), second = submit("ann", 4), low = submit("bob");
  turns(20);
  EXPECT_EQ(farm.job(second).waiting,
            "waits behind job " + first.value + ", whose priority is higher (5, not 4)");
  const JobStatus status = farm.job(low);
  EXPECT_THAT(status.waiting, HasSubstr("(5, not 0); one more is before it"));
  EXPECT_LT(status.turn_seconds, 0) << "nobody knows how long the second one takes";
  EXPECT_GT(farm.job(second).turn_seconds, 0);
}

TEST_F(WaitingTest, ATimeLimitTellsTheEnd) {
  hire(1);
  submit("ann", 5, 4096);
  const JobId low = submit("bob", 0, kMaxSpp, 30);
  turns(20);
  const JobStatus status = farm.job(low);
  ASSERT_GT(status.turn_seconds, 0);
  EXPECT_NEAR(status.eta_seconds, status.turn_seconds + 30, 1e-6);
}

TEST_F(WaitingTest, UntilAnotherSubmitterHasHadAsMuch) {
  hire(1);
  const JobId ann = submit("ann"), bob = submit("bob");
  costs[ann] = 100;
  ASSERT_GE(turns_until(ann), 0);
  turns(12);
  const JobStatus status = farm.job(ann);
  EXPECT_EQ(status.waiting, "waits behind job " + bob.value +
                                ", whose submitter bob has had less of the workers' time than ann");
  const int waited = turns_until(ann);
  EXPECT_GT(waited, 10);
  EXPECT_NEAR(status.turn_seconds, waited, 3 + 0.2 * waited);
}

TEST_F(WaitingTest, BehindOneThatIsLateForItsDeadline) {
  hire(1);
  const JobId plain = submit("ann");
  turns(30);
  JobRequest request = small_job(64, 64, kMaxSpp, Integrator::kPt);
  request.submitter = "ann";
  request.deadline = clock.now() + 5;
  const JobId urgent = farm.submit(request);
  turns(12);
  EXPECT_EQ(farm.job(plain).waiting, "waits behind job " + urgent.value + ", which is late for its deadline");
  EXPECT_LT(farm.job(plain).turn_seconds, 0) << "that one has no end";
}

TEST_F(WaitingTest, ComesNextWhenAllWorkersAreBusy) {
  hire(1);
  submit("ann");
  turns(3);
  const LeaseGrant held = farm.lease(workers[0]).value();
  const JobId next = submit("ann");
  EXPECT_EQ(farm.job(next).waiting, "comes next, once a worker has finished its tile");
  commit(workers[0], held);
  EXPECT_EQ(farm.lease(workers[0]).value().job, next);
}

TEST_F(WaitingTest, ForTheEndOfTheJobsThatItComesAfter) {
  hire(1);
  const JobId first = submit("ann", 0, 512);
  JobRequest request = small_job(64, 64, 16, Integrator::kPt);
  request.after = {first};
  const JobId last = farm.submit(request);
  turns(20);
  const JobStatus status = farm.job(last);
  EXPECT_EQ(status.waiting, "waits for job " + first.value + ", which is running");
  EXPECT_EQ(status.waits_behind, first);
  EXPECT_NEAR(status.turn_seconds, farm.job(first).eta_seconds, 1e-6);
  const int waited = turns_until(last);
  ASSERT_GT(waited, 20);
  EXPECT_NEAR(status.turn_seconds, waited, 0.6 * waited) << "its rate still grows with its rounds";
}

TEST_F(WaitingTest, TheOrderOfTenThousandIsMadeOnceASecond) {
  hire(1);
  const JobId high = submit("ann", 5);
  std::vector<JobId> low;
  for (int i = 0; i < 200; ++i) low.push_back(submit("bob"));
  turns(20);
  for (const JobId& job : low) EXPECT_EQ(farm.job(job).waits_behind, high);
  EXPECT_THAT(farm.job(low.back()).waiting, HasSubstr("; 199 more are before it"));
}

class LittleMemoryTest : public WaitingTest {
 protected:
  static FarmOptions for_one_film() {
    FarmOptions options = fake_options();
    options.film_memory_bytes = 1.5 * film_bytes(small_job(64, 64, kMaxSpp, Integrator::kPt).settings);
    return options;
  }
  LittleMemoryTest() : WaitingTest(for_one_film()) {}
};

TEST_F(LittleMemoryTest, ForRoomForItsFilm) {
  hire(1);
  const JobId first = submit("ann");
  turns(3);
  const JobId second = submit("ann");
  EXPECT_EQ(farm.job(second).waits_behind, first);
  EXPECT_THAT(farm.job(second).waiting,
              HasSubstr("waits behind job " + first.value + ": the coordinator's memory has no room"));
}

}  // namespace
}  // namespace lightmill
