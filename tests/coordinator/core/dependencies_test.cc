// Jobs that come after others, and jobs that take only so many workers.
#include <set>

#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

class DependenciesTest : public FarmFixture {
 protected:
  JobId submit_after(const std::vector<JobId>& after, int priority = 0) {
    JobRequest request = small_job(64, 64, 2);
    request.after = after;
    request.priority = priority;
    return farm.submit(request);
  }
};

TEST_F(DependenciesTest, AJobStartsOnceTheOthersAreDone) {
  const JobId first = submit_after({}), second = submit_after({}), last = submit_after({first, second}, 5);
  EXPECT_EQ(farm.job(last).after, (std::vector{first, second}));
  EXPECT_THAT(farm.job(last).message, HasSubstr("waits for job " + first.value + ", which is queued"));
  const WorkerId ann = join();
  std::set<JobId> leased;
  while (farm.job(first).state != JobState::kDone || farm.job(second).state != JobState::kDone) {
    const auto grant = farm.lease(ann);
    ASSERT_TRUE(grant);
    EXPECT_NE(grant->job, last);
    commit(ann, *grant);
    if (farm.job(first).state == JobState::kDone && farm.job(second).state != JobState::kDone) {
      EXPECT_THAT(farm.job(last).message, HasSubstr("waits for job " + second.value));
    }
  }
  EXPECT_EQ(farm.job(last).message, "");
  EXPECT_EQ(farm.lease(ann).value().job, last);
  farm.extend(first, 10, {}, {});
  EXPECT_EQ(farm.lease(ann).value().job, last) << "what has begun goes on";
}

TEST_F(DependenciesTest, OneThatFailedOrWasCancelledBlocksWithAReason) {
  const JobId first = submit_after({}), last = submit_after({first});
  const WorkerId ann = join();
  for (int i = 0; i < 5; ++i) farm.fail(ann, key(farm.lease(ann).value()), "no");
  ASSERT_EQ(farm.job(first).state, JobState::kFailed);
  EXPECT_FALSE(farm.lease(ann));
  EXPECT_EQ(farm.job(last).state, JobState::kQueued);
  EXPECT_THAT(farm.job(last).message,
              HasSubstr("blocked: it comes after job " + first.value + ", which failed"));
  farm.retry(first);
  farm.cancel(first);
  EXPECT_THAT(farm.job(last).message, HasSubstr("was cancelled"));
  const JobId third = submit_after({first, last});
  EXPECT_FALSE(farm.lease(ann)) << "also for those behind it";
  farm.retry(first);
  EXPECT_GT(work(farm, ann), 0);
  for (const JobId& job : {first, last, third}) EXPECT_EQ(farm.job(job).state, JobState::kDone) << job.value;
}

TEST_F(DependenciesTest, UnknownJobsAndTooManyAreRefused) {
  EXPECT_THAT(error_of([&] { submit_after({JobId{"j1"}}); }), HasSubstr("no job \"j1\""))
      << "not even itself";
  const JobId first = submit_after({});
  EXPECT_THAT(error_of([&] { submit_after(std::vector<JobId>(1001, first)); }), HasSubstr("1000"));
  JobRequest request = small_job(64, 64, 2);
  request.max_workers = -1;
  EXPECT_THAT(error_of([&] { farm.submit(request); }), HasSubstr("limit of workers"));
}

TEST_F(DependenciesTest, NoMoreWorkersThanItsLimit) {
  JobRequest request = small_job(640, 640, 16);
  request.max_workers = 2;
  const JobId limited = farm.submit(request);
  const WorkerId ann = join(), bob = join(), eve = join();
  const LeaseGrant anns = farm.lease(ann).value();
  farm.lease(bob);
  EXPECT_FALSE(farm.lease(eve));
  EXPECT_EQ(farm.lease(ann).value().job, limited) << "who is in may hold more tiles";
  EXPECT_EQ(farm.job(limited).workers, 2);
  EXPECT_EQ(farm.job(limited).max_workers, 2);
  const JobId open = farm.submit(small_job(64, 64, 2));
  EXPECT_EQ(farm.lease(eve).value().job, open) << "and who is not takes other jobs";
  clock.advance(9);
  farm.renew(ann, {key(anns)});
  clock.advance(2);  // bob's lease runs out
  EXPECT_TRUE(farm.lease(eve)) << "his place is free";
}

}  // namespace
}  // namespace lightmill
