// Ends of jobs and sequences stay until they were told: once each, and after a restart, too.
#include <gmock/gmock.h>

#include "coordinator/store/sqlite/sqlite_job_store.h"
#include "tests/coordinator/core/fake_worker.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

using namespace testing;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class EndNewsTest : public ::testing::Test {
 protected:
  EndNewsTest() { start(true); }
  void start(bool tells) {
    FarmOptions options = fake_options();
    options.tells_ends = tells;
    farm.reset();
    farm = std::make_unique<Farm>(std::make_unique<SqliteJobStore>(folder.file("s")), clock, options);
  }
  void render() { work(*farm, farm->register_worker(registration())); }
  std::vector<EndNote> untold() const { return farm->untold_ends(100); }
  SequenceId shot(int frames, double budget_seconds = 0) {
    SequenceRequest request;
    request.budget_seconds = budget_seconds;
    std::vector<FrameRequest> list;
    for (int i = 1; i <= frames; ++i) list.push_back({i, fake_bundle(), small_settings(32, 32, 16)});
    return farm->submit(request, list);
  }
  const test::TemporaryFolder folder;
  const FakeClock clock;
  std::unique_ptr<Farm> farm;
};

TEST_F(EndNewsTest, AJobsEndIsToldOnce) {
  const JobId job = farm->submit(small_job(32, 32, 16)), other = farm->submit(small_job(32, 32, 16));
  EXPECT_THAT(untold(), IsEmpty());
  render();
  EXPECT_THAT(untold(), ElementsAre(EndNote{"j1", 1}, EndNote{"j2", 1}));
  EXPECT_THAT(farm->untold_ends(1), ElementsAre(EndNote{"j1", 1}));
  start(true);
  EXPECT_THAT(untold(), ElementsAre(EndNote{"j1", 1}, EndNote{"j2", 1}))
      << "nobody was told before the crash";
  farm->told({"j1", 1});
  start(true);
  EXPECT_THAT(untold(), ElementsAre(EndNote{"j2", 1}));
  EXPECT_EQ(farm->job(job).state, JobState::kDone);

  farm->extend(job, 32, {}, {});
  EXPECT_THAT(untold(), ElementsAre(EndNote{"j2", 1})) << "it goes on";
  farm->told({"j2", 1});
  render();
  EXPECT_THAT(untold(), ElementsAre(EndNote{"j1", 2})) << "and ends again";
  farm->told({"j1", 1});
  EXPECT_THAT(untold(), ElementsAre(EndNote{"j1", 2}))
      << "the first end was told twice, which is no second one";
  farm->told({"j1", 2});
  EXPECT_THAT(untold(), IsEmpty());
}

TEST_F(EndNewsTest, SoAreFailuresAndCancellations) {
  const JobId job = farm->submit(small_job(32, 32, 16));
  farm->cancel(job);
  EXPECT_THAT(untold(), ElementsAre(EndNote{"j1", 1}));
  farm->retry(job);
  EXPECT_THAT(untold(), IsEmpty());
  render();
  EXPECT_THAT(untold(), ElementsAre(EndNote{"j1", 2}));
}

TEST_F(EndNewsTest, ASequenceIsToldAsAWhole) {
  const SequenceId id = shot(3);
  farm->cancel(JobId{"s1.2"});
  EXPECT_THAT(untold(), IsEmpty()) << "its other frames have not ended";
  render();
  EXPECT_THAT(untold(), ElementsAre(EndNote{"s1", 1}));
  start(true);
  EXPECT_THAT(untold(), ElementsAre(EndNote{"s1", 1}));
  farm->told({"s1", 1});
  start(true);
  EXPECT_THAT(untold(), IsEmpty());
  farm->retry(id);
  EXPECT_THAT(untold(), IsEmpty());
  start(true);
  render();
  EXPECT_THAT(untold(), ElementsAre(EndNote{"s1", 2}));
  farm->told({"s1", 2});
  farm->extend(id, 32, {}, {});
  farm->cancel(id);
  EXPECT_THAT(untold(), ElementsAre(EndNote{"s1", 3}));
}

TEST_F(EndNewsTest, ABudgetIsSpentFirst) {
  const SequenceId id = shot(2, 1e-6);
  render();
  EXPECT_THAT(untold(), IsEmpty()) << "who knows whether it gets more samples?";
  farm->tick();
  EXPECT_THAT(untold(), ElementsAre(EndNote{id.value, 1}));
}

TEST_F(EndNewsTest, WithoutHooksNothingIsKept) {
  start(false);
  farm->submit(small_job(32, 32, 16));
  shot(2);
  render();
  EXPECT_THAT(untold(), IsEmpty());
  start(true);
  EXPECT_THAT(untold(), IsEmpty()) << "whoever asks from now on wants no old news";
  farm->told({"j1", 1});
  EXPECT_THROW(farm->told({"j9", 1}), Error);
}

}  // namespace
}  // namespace lightmill
