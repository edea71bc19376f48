#include "coordinator/http/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "coordinator/store/memory_job_store.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

JobStatus job(JobState state, int64_t packets_done, int64_t packets_total, double cpu_seconds) {
  JobStatus status;
  status.state = state;
  status.packets_done = packets_done;
  status.packets_total = packets_total;
  status.cpu_seconds = cpu_seconds;
  return status;
}

WorkerStatus worker(const char* state, int threads) {
  WorkerStatus status;
  status.state = state;
  status.registration.threads = threads;
  return status;
}

TEST(WorkersWanted, FinishTheRestInTheTimeGiven) {
  // 1000 packets at 2 CPU seconds each are left: 2000 s, in 100 s, by workers of 4 threads.
  const std::vector<JobStatus> jobs = {job(JobState::kRunning, 500, 1500, 1000)};
  EXPECT_EQ(workers_wanted(jobs, {worker("idle", 4), worker("rendering", 4)}, 100), 5);
  EXPECT_EQ(workers_wanted(jobs, {worker("idle", 4), worker("lost", 64), worker("refused", 64)}, 100), 5)
      << "only who is there counts";
  EXPECT_EQ(workers_wanted(jobs, {}, 100), 20) << "without any, workers of one thread are assumed";
}

TEST(WorkersWanted, IsAboutOpenJobsAlone) {
  EXPECT_EQ(workers_wanted({}, {worker("idle", 1)}, 100), 0);
  for (const JobState state : {JobState::kPaused, JobState::kDone, JobState::kFailed, JobState::kCancelled})
    EXPECT_EQ(workers_wanted({job(state, 10, 1000, 1e6)}, {worker("idle", 1)}, 100), 0);
}

TEST(WorkersWanted, AJobOfUnknownRateAsksForOne) {
  EXPECT_EQ(workers_wanted({job(JobState::kQueued, 0, 1000, 0), job(JobState::kQueued, 0, 0, 0)}, {}, 600),
            2);
}

TEST(WorkersWanted, JobsMayAllowFewAndWaitForOthers) {
  JobStatus first = job(JobState::kRunning, 500, 1500, 1000);  // 2000 s left
  first.id = JobId{"j1"};
  first.max_workers = 3;
  JobStatus second = job(JobState::kQueued, 0, 1000, 0);
  second.id = JobId{"j2"};
  second.after = {first.id};
  EXPECT_EQ(workers_wanted({first, second}, {}, 100), 3);
  first.state = JobState::kDone;
  EXPECT_EQ(workers_wanted({first, second}, {}, 100), 1);
}

TEST(WorkersWanted, IsNeverMoreThanThereArePackets) {
  EXPECT_EQ(workers_wanted({job(JobState::kRunning, 10, 13, 1e9)}, {worker("idle", 1)}, 600), 3);
  EXPECT_EQ(workers_wanted({job(JobState::kRunning, 10, 13, 1e300)}, {worker("idle", 1)}, 600), 3);
}

TEST(JobMetrics, HaveTheErrorAtEveryScaleThatIsKnown) {
  const FakeClock clock;
  auto store = std::make_unique<MemoryJobStore>();
  JobRecord record;
  record.id = JobId{"j1"};
  record.state = JobState::kRunning;
  record.settings = testing::small_settings(64, 64, 320);
  store->add_job(record, bundle_to_json(testing::fake_bundle()), {});
  ErrorPoint point;
  point.relmse = 0.25;
  point.boxes[0].relmse = 0.5;
  point.boxes[1].relmse = 0.75;
  store->add_point(record.id, point);
  const Farm farm(std::move(store), clock, testing::fake_options());
  const std::string text = Metrics(farm).text();
  EXPECT_THAT(text, HasSubstr("lightmill_job_relmse{job=\"j1\"} 0.25\n"));
  EXPECT_THAT(text, HasSubstr("lightmill_job_relmse_boxes{job=\"j1\",side=\"4\"} 0.5\n"));
  EXPECT_THAT(text, HasSubstr("lightmill_job_relmse_boxes{job=\"j1\",side=\"16\"} 0.75\n"));
  EXPECT_THAT(text, Not(HasSubstr("side=\"32\"")));
}

TEST(JobMetrics, TellTheKindsOfDroppedLight) {
  const FakeClock clock;
  auto store = std::make_unique<MemoryJobStore>();
  JobRecord record;
  record.id = JobId{"j1"};
  record.settings = testing::small_settings(64, 64, 320);
  record.counters.nonfinite = 5;
  record.dropped.of(DropKind::kNegative) = {5, 1};
  record.dropped.of(DropKind::kCapped) = {7, 1};
  store->add_job(record, bundle_to_json(testing::fake_bundle()), {});
  const Farm farm(std::move(store), clock, testing::fake_options());
  const std::string text = Metrics(farm).text();
  EXPECT_THAT(text, HasSubstr("lightmill_nonfinite_contributions 5\n"));
  EXPECT_THAT(text, HasSubstr("lightmill_dropped_contributions{kind=\"negative\"} 5\n"));
  EXPECT_THAT(text, HasSubstr("lightmill_dropped_contributions{kind=\"capped\"} 7\n"));
  EXPECT_THAT(text, HasSubstr("lightmill_dropped_contributions{kind=\"below_range\"} 0\n"));
}

}  // namespace
}  // namespace lightmill
