#include "coordinator/http/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lightmill {
namespace {

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

}  // namespace
}  // namespace lightmill
