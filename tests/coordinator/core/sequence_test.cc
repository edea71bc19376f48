// Sequences: frames in their order, each with the pixels that it has alone, one share for all, and what users
// do to them. Time is simulated.
#include <algorithm>
#include <map>
#include <vector>

#include "tests/coordinator/core/farm_fixture.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::HasSubstr;

FrameRequest frame(int number, int64_t spp = 16) {
  FrameRequest request;
  request.number = number;
  request.bundle = fake_bundle();
  request.bundle.pose.time = number / 24.0;
  request.settings = small_settings(64, 64, spp);
  return request;
}

std::vector<FrameRequest> frames(int first, int last, int64_t spp = 16) {
  std::vector<FrameRequest> list;
  for (int i = first; i <= last; ++i) list.push_back(frame(i, spp));
  return list;
}

class SequenceTest : public FarmFixture {
 protected:
  using FarmFixture::FarmFixture;
  SequenceId submit(int first, int last, int64_t spp = 16, const SequenceRequest& request = {}) {
    return farm.submit(request, frames(first, last, spp));
  }
  JobState state(const std::string& job) { return farm.job(JobId{job}).state; }
  /// The frames of the next leases of one worker that commits them.
  std::vector<int> begun(const WorkerId& worker) {
    std::vector<int> order;
    while (const auto grant = farm.lease(worker)) {
      const auto of = frame_of(grant->job);
      if (of && std::find(order.begin(), order.end(), of->number) == order.end()) order.push_back(of->number);
      EXPECT_EQ(commit(worker, *grant), CommitResult::kAccepted);
    }
    return order;
  }
};

TEST_F(SequenceTest, RendersItsFramesInOrderWithThePixelsOfEachAlone) {
  const SequenceId id = submit(-1, 3);
  EXPECT_EQ(id.value, "s1");
  const WorkerId ann = join();
  EXPECT_EQ(farm.sequence(id).state, JobState::kQueued);
  EXPECT_EQ(begun(ann), (std::vector{-1, 0, 1, 2, 3}));
  const SequenceStatus status = farm.sequence(id);
  EXPECT_EQ(status.state, JobState::kDone);
  EXPECT_EQ(status.frames[static_cast<int>(JobState::kDone)], 5);
  EXPECT_EQ(status.first_frame, -1);
  EXPECT_EQ(status.last_frame, 3);
  EXPECT_EQ(status.packets_done, status.packets_total);
  JobRequest alone = small_job(64, 64, 16);
  const JobId single = farm.submit(alone);
  work(farm, ann);
  for (const FrameStatus& f : farm.frames(id, {}, 100, 0).frames)
    EXPECT_TRUE(same_pixels(farm.image(f.job), farm.image(single))) << f.job.value;
}

TEST_F(SequenceTest, CoarseFirstBeginsWithEveryTenth) {
  SequenceRequest request;
  request.order = FrameOrder::kCoarseFirst;
  submit(1, 22, 16, request);
  std::vector<int> expected = {1, 11, 21};
  for (int i = 1; i <= 22; ++i) {
    if (i % 10 != 1) expected.push_back(i);
  }
  EXPECT_EQ(begun(join()), expected);
}

TEST_F(SequenceTest, OnlyFramesThatSomebodyNeedsAreOpened) {
  const SequenceId id = submit(1, 100, 64);
  const WorkerId ann = join();
  work(farm, ann, 3);
  int touched = 0;
  for (const FrameStatus& f : farm.frames(id, {}, 1000, 0).frames) touched += f.state != JobState::kQueued;
  EXPECT_EQ(touched, 1);
  // When the first frame has nothing left, another worker gets the second.
  std::vector<LeaseGrant> held;
  std::set<std::string> jobs;
  while (jobs.size() < 2 && held.size() < 1000) {
    const WorkerId worker = join();
    held.push_back(farm.lease(worker).value());
    jobs.insert(held.back().job.value);
  }
  EXPECT_EQ(jobs, (std::set<std::string>{"s1.1", "s1.2"}));
  EXPECT_THAT(farm.job(JobId{"s1.50"}).message, HasSubstr("waits for its turn in sequence s1"));
}

TEST_F(SequenceTest, CountsAsOneJobAmongItsSubmitters) {
  SequenceRequest request;
  request.submitter = "ann";
  submit(1, 50, 1 << 12, request);
  JobRequest other = small_job(64, 64, 1 << 20, Integrator::kPt);
  other.submitter = "ann";
  JobRequest bobs = other;
  bobs.submitter = "bob";
  const JobId single = farm.submit(other), bob = farm.submit(bobs);
  const WorkerId workers[] = {join(), join(), join(), join()};
  std::map<std::string, double> served;
  for (int turn = 0; turn < 200; ++turn) {
    std::vector<std::pair<WorkerId, LeaseGrant>> held;
    for (const WorkerId& worker : workers) {
      if (const auto grant = farm.lease(worker)) held.emplace_back(worker, *grant);
    }
    clock.advance(1);
    for (const auto& [worker, grant] : held) {
      ASSERT_EQ(commit(worker, grant, 2), CommitResult::kAccepted);
      served[frame_of(grant.job) ? "sequence" : grant.job.value] += 2;
    }
  }
  const double all = served["sequence"] + served[single.value] + served[bob.value];
  EXPECT_NEAR(served[bob.value] / all, 0.5, 0.04);
  EXPECT_NEAR(served["sequence"] / all, 0.25, 0.04);
  EXPECT_NEAR(served[single.value] / all, 0.25, 0.04);
}

TEST_F(SequenceTest, ASingleImageGetsInBetween) {
  SequenceRequest request;
  request.submitter = "ann";
  submit(1, 50, 64, request);
  const WorkerId worker = join();
  work(farm, worker, 20);
  JobRequest single = small_job(64, 64, 8);
  single.submitter = "ann";
  const JobId job = farm.submit(single);
  EXPECT_EQ(farm.lease(worker).value().job, job);
}

TEST_F(SequenceTest, PauseResumeCancelRetryExtend) {
  const SequenceId id = submit(1, 12);
  const WorkerId ann = join();
  work(farm, ann, 3);
  farm.pause(id);
  EXPECT_EQ(farm.sequence(id).state, JobState::kPaused);
  EXPECT_FALSE(farm.lease(ann));
  EXPECT_THAT(error_of([&] { farm.pause(id); }), HasSubstr("no frame of sequence s1 is queued or running"));
  farm.resume(JobId{"s1.7"});  // a frame alone
  EXPECT_EQ(begun(ann), (std::vector{7}));
  farm.resume(id);
  const LeaseGrant doomed = farm.lease(ann).value();
  farm.cancel(id);
  EXPECT_EQ(commit(ann, doomed), CommitResult::kUnknownJob);
  EXPECT_EQ(farm.sequence(id).state, JobState::kCancelled);
  EXPECT_EQ(state("s1.7"), JobState::kDone);
  EXPECT_FALSE(farm.lease(ann));
  farm.retry(id);
  EXPECT_EQ(farm.sequence(id).state, JobState::kRunning);
  work(farm, ann);
  EXPECT_EQ(farm.sequence(id).state, JobState::kDone);
  farm.extend(id, 32, {}, {});
  work(farm, ann);
  EXPECT_EQ(farm.sequence(id).state, JobState::kDone);
  for (const FrameStatus& f : farm.frames(id, {}, 100, 0).frames) {
    EXPECT_EQ(f.spp, 32);
    EXPECT_TRUE(same_pixels(farm.image(f.job), fake_image(small_settings(64, 64, 32))));
  }
  EXPECT_THAT(error_of([&] { farm.extend(id, 8, {}, {}); }), HasSubstr("planned already"));
  EXPECT_THAT(error_of([&] { farm.sequence(SequenceId{"s9"}); }), HasSubstr("no sequence \"s9\""));
}

TEST_F(SequenceTest, AFrameThatFailsStopsNoOther) {
  const SequenceId id = submit(1, 4);
  const WorkerId ann = join();
  bool failed = false;
  while (const auto grant = farm.lease(ann)) {
    if (grant->job.value == "s1.2") {
      farm.fail(ann, key(*grant), "no camera", FailureKind::kScene);
      failed = true;
    } else {
      commit(ann, *grant);
    }
  }
  EXPECT_TRUE(failed);
  const SequenceStatus status = farm.sequence(id);
  EXPECT_EQ(status.state, JobState::kFailed);
  EXPECT_EQ(status.frames[static_cast<int>(JobState::kDone)], 3);
  EXPECT_THAT(status.message, HasSubstr("1 failed, first frame 2: "));
  EXPECT_THAT(status.message, HasSubstr("no camera"));
  farm.retry(id);
  work(farm, ann);
  EXPECT_EQ(farm.sequence(id).state, JobState::kDone);
}

TEST_F(SequenceTest, PriorityIsTheSequences) {
  const SequenceId first = submit(1, 3), second = submit(1, 3);
  const WorkerId ann = join();
  farm.set_priority(second, 5);
  EXPECT_EQ(farm.lease(ann).value().job.value, "s2.1");
  EXPECT_EQ(farm.job(JobId{"s2.3"}).priority, 5);
  EXPECT_THAT(error_of([&] { farm.set_priority(JobId{"s1.1"}, 9); }), HasSubstr("sequence s1"));
  EXPECT_EQ(farm.sequence(first).request.priority, 0);
}

TEST_F(SequenceTest, FramesComeLaterAndTwiceDoesNoHarm) {
  const SequenceId id = submit(1, 3);
  farm.add_frames(id, frames(2, 6));
  EXPECT_EQ(farm.sequence(id).frame_count, 6);
  FrameRequest other = frame(2);
  other.bundle.pose.time = 99;
  EXPECT_THAT(error_of([&] { farm.add_frames(id, {other}); }), HasSubstr("another frame 2"));
  EXPECT_THAT(error_of([&] { farm.add_frames(id, {}); }), HasSubstr("1 to 1000 frames"));
  EXPECT_THAT(error_of([&] {
                farm.add_frames(id, {frame(8), frame(8)});
              }),
              HasSubstr("frame 8 is there twice"));
  EXPECT_THAT(error_of([&] { farm.submit(SequenceRequest{}, frames(1, 1001)); }), HasSubstr("further calls"));
  SequenceRequest still;
  still.fps = 0;
  EXPECT_THAT(error_of([&] { farm.submit(still, frames(1, 2)); }), HasSubstr("frames a second"));
}

TEST_F(SequenceTest, PagesOfFrames) {
  const SequenceId id = submit(1, 7);
  FramePage page = farm.frames(id, {}, 3, 0);
  EXPECT_EQ(page.frames.size(), 3u);
  EXPECT_EQ(page.last, 3);
  EXPECT_EQ(page.total, 7u);
  page = farm.frames(id, page.last, 3, 0);
  EXPECT_EQ(page.frames.front().number, 4);
  page = farm.frames(id, page.last, 3, 0);
  EXPECT_EQ(page.frames.size(), 1u);
  EXPECT_FALSE(page.last);
  const uint64_t version = farm.sequence(id).version;
  EXPECT_TRUE(farm.frames(id, {}, 100, version).frames.empty());
  work(farm, join(), 1);
  EXPECT_EQ(farm.frames(id, {}, 100, version).frames.size(), 1u);
  EXPECT_GT(farm.sequence(id).version, version);
}

TEST_F(SequenceTest, WorkersOfAllFramesAreLimited) {
  SequenceRequest request;
  request.max_workers = 2;
  submit(1, 5, 4096, request);
  EXPECT_TRUE(farm.lease(join()));
  EXPECT_TRUE(farm.lease(join()));
  EXPECT_FALSE(farm.lease(join()));
}

TEST_F(SequenceTest, JobsAndSequencesWaitForEachOther) {
  const JobId first = farm.submit(small_job(64, 64, 8));
  SequenceRequest request;
  request.after = {first};
  const SequenceId shot = submit(1, 3, 8, request);
  JobRequest last = small_job(64, 64, 8);
  last.after = {JobId{shot.value}};
  const JobId comp = farm.submit(last);
  const WorkerId ann = join();
  std::vector<std::string> order;
  while (const auto grant = farm.lease(ann)) {
    if (order.empty() || order.back() != grant->job.value) order.push_back(grant->job.value);
    commit(ann, *grant);
  }
  EXPECT_EQ(order, (std::vector<std::string>{first.value, "s1.1", "s1.2", "s1.3", comp.value}));
  last.after = {JobId{"s77"}};
  EXPECT_THAT(error_of([&] { farm.submit(last); }), HasSubstr("s77"));
}

TEST_F(SequenceTest, ABudgetIsSpentWhereTheErrorFallsMost) {
  SequenceRequest request;
  request.budget_seconds = 200;
  request.most_spp = 4096;
  const SequenceId id = farm.submit(request, frames(1, 4, 4096));
  const WorkerId ann = join();
  // A tile's time as frame 3 costs four times as much; all have about the same error.
  double spent = 0;
  for (int i = 0; i < 10000 && farm.sequence(id).state != JobState::kDone; ++i) {
    farm.tick();
    const auto grant = farm.lease(ann);
    if (!grant) continue;
    const double samples = static_cast<double>(grant->settings.grid.pixels(grant->tile.cells).area()) *
                           static_cast<double>(grant->tile.samples());
    const double seconds = samples * (grant->job.value == "s1.3" ? 4e-5 : 1e-5);
    spent += seconds;
    ASSERT_EQ(commit(ann, *grant, seconds), CommitResult::kAccepted);
  }
  const SequenceStatus status = farm.sequence(id);
  EXPECT_EQ(status.state, JobState::kDone);
  EXPECT_LE(spent, request.budget_seconds);
  EXPECT_GT(spent, request.budget_seconds / 3) << "the next step of any frame would be too long";
  const std::vector<FrameStatus> list = farm.frames(id, {}, 10, 0).frames;
  for (const FrameStatus& f : list) {
    EXPECT_GE(f.spp, 64) << f.number;
    if (f.number != 3) EXPECT_GT(f.spp, list[2].spp) << "cheap ones gain more";
    const auto alone = small_settings(64, 64, static_cast<int64_t>(f.spp));
    EXPECT_TRUE(same_pixels(farm.image(f.job), fake_image(alone))) << f.number;
  }
}

TEST_F(SequenceTest, ManyFramesCostALeaseLittle) {
  SequenceRequest request;
  const SequenceId id = farm.submit(request, frames(1, 1000));
  for (int i = 1; i < 20; ++i) farm.add_frames(id, frames(1000 * i + 1, 1000 * i + 1000));
  EXPECT_EQ(farm.sequence(id).frame_count, 20000);
  EXPECT_THAT(error_of([&] { farm.add_frames(id, {frame(20001)}); }), HasSubstr("at most 20000"));
  // All that are looked at for a lease are those that somebody works on, and the next.
  const WorkerId ann = join();
  EXPECT_EQ(work(farm, ann, 200), 200);
  farm.cancel(id);
  EXPECT_EQ(farm.sequence(id).state, JobState::kCancelled);
}

}  // namespace
}  // namespace lightmill
