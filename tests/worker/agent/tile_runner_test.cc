#include "worker/agent/tile_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <fstream>
#include <thread>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/farm/pilot_result.h"
#include "common/film/film.h"
#include "tests/worker/agent/fake_farm.h"
#include "tests/worker/agent/temporary_folder.h"

namespace lightmill::agent {
namespace {

using testing::FakeFarm;
using testing::FixedSource;
using ::testing::HasSubstr;

class TileRunnerTest : public ::testing::Test {
 protected:
  void start(int threads, double drain_timeout_seconds = 60, double idle_timeout_seconds = 0) {
    RunnerOptions options;
    options.idle_timeout_seconds = idle_timeout_seconds;
    options.drain_timeout_seconds = drain_timeout_seconds;
    options.threads = threads;
    options.registration.host = "here";
    options.registration.threads = threads;
    options.log = [this](const std::string& line) {
      const std::lock_guard lock(log_mutex_);
      log_ += line + "\n";
    };
    runner_ = std::make_unique<TileRunner>(farm_, source_, options);
    thread_ = std::thread([this] {
      try {
        runner_->run();
      } catch (const Error& error) {
        error_ = error.what();
      }
    });
  }
  void join() {
    if (thread_.joinable()) thread_.join();
  }
  void TearDown() override {
    if (runner_) runner_->stop();
    join();
  }
  void add_tiles(int count, double lease_seconds = 10) {
    for (int i = 0; i < count; ++i) farm_.add({{0, 0, 3, 2}, 8 * i, 8 * i + 8}, lease_seconds);
  }

  /// Until `condition` holds; false after a generous time.
  template <class Condition>
  bool wait_until(Condition condition) {
    for (int i = 0; i < 60000 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return condition();
  }
  size_t answers() {
    const std::lock_guard lock(farm_.mutex_);
    return farm_.commits.size() + farm_.failures.size();
  }
  int renewals() {
    const std::lock_guard lock(farm_.mutex_);
    return farm_.renewals;
  }

  FakeFarm farm_;
  FixedSource source_;
  std::unique_ptr<TileRunner> runner_;
  std::thread thread_;
  std::string error_, log_;
  std::mutex log_mutex_;
};

TEST_F(TileRunnerTest, RendersAndCommitsEveryTileOnce) {
  add_tiles(12);
  start(3);
  ASSERT_TRUE(farm_.wait_for_answers(12));
  Film film(testing::small_grid());
  for (const auto& [key, bytes] : farm_.commits) {
    ASSERT_EQ(bytes.size(), 1u);
    film.fold(decode_partial(bytes.front()));
  }
  EXPECT_EQ(film.cell_samples(0, 0), 12 * 8);
  const Image image = film.resolve();
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) ASSERT_EQ(image.pixel(x, y)[0], 1.0f);
  }
  EXPECT_EQ(farm_.registrations, 1);
  EXPECT_EQ(farm_.last_registration.host, "here");
  EXPECT_LE(farm_.most_held, 4);
}

TEST_F(TileRunnerTest, KeepsTryingWhileTheCoordinatorIsDown) {
  farm_.down_calls = 3;
  add_tiles(2);
  start(1);
  ASSERT_TRUE(farm_.wait_for_answers(2));
  EXPECT_EQ(farm_.commits.size(), 2u);
}

TEST_F(TileRunnerTest, TellsOnceAJobWhatLightItsImageLacks) {
  source_.renderer->missing = {"about a tenth"};
  farm_.down_calls = 1;
  add_tiles(4);
  start(2);
  ASSERT_TRUE(farm_.wait_for_answers(4));
  ASSERT_EQ(farm_.warnings.size(), 1u);
  EXPECT_EQ(farm_.warnings.front().first.job, JobId{"j1"});
  EXPECT_EQ(farm_.warnings.front().second, source_.renderer->missing);
  {
    const std::lock_guard lock(farm_.mutex_);
    farm_.forget = true;
  }
  add_tiles(4);
  ASSERT_TRUE(farm_.wait_for_answers(8));
  EXPECT_EQ(farm_.warnings.size(), 2u) << "what was forgotten is told again";
}

TEST_F(TileRunnerTest, RegistersAgainWhenForgotten) {
  add_tiles(1);
  start(1);
  ASSERT_TRUE(farm_.wait_for_answers(1));
  {
    const std::lock_guard lock(farm_.mutex_);
    farm_.forget = true;
  }
  farm_.add({{0, 0, 1, 1}, 8, 16});
  ASSERT_TRUE(farm_.wait_for_answers(2));
  EXPECT_GE(farm_.registrations, 2);
}

TEST_F(TileRunnerTest, ARefusalEndsTheRunWithItsSentence) {
  farm_.refusal = "build A is not build B; install the coordinator's";
  start(2);
  join();
  EXPECT_EQ(error_, farm_.refusal);
}

TEST_F(TileRunnerTest, ASceneThatFailsToLoadFailsTheLease) {
  source_.error = "scene.pbrt:3:1: no such shape";
  add_tiles(1);
  start(1);
  ASSERT_TRUE(farm_.wait_for_answers(1));
  ASSERT_EQ(farm_.failures.size(), 1u);
  EXPECT_EQ(farm_.failures.begin()->second, source_.error);
}

TEST_F(TileRunnerTest, APacketThatThrowsFailsTheLeaseAndTheWorkerLivesOn) {
  source_.renderer->fail_cell_x = 2;
  farm_.add({{2, 0, 3, 1}, 0, 8});
  farm_.add({{0, 0, 2, 1}, 0, 8});
  start(2);
  ASSERT_TRUE(farm_.wait_for_answers(2));
  ASSERT_EQ(farm_.failures.size(), 1u);
  EXPECT_EQ(farm_.failures.begin()->second, "cell on fire");
  EXPECT_EQ(farm_.commits.size(), 1u);
}

// Or its lease would run out, again and again.
TEST_F(TileRunnerTest, ATileThatThereIsNoMemoryToHandInFailsItsLease) {
  farm_.no_memory = true;
  add_tiles(1);
  start(1);
  ASSERT_TRUE(farm_.wait_for_answers(1));
  const std::lock_guard lock(farm_.mutex_);
  ASSERT_EQ(farm_.failures.size(), 1u);
  EXPECT_THAT(farm_.failures.begin()->second, HasSubstr("out of memory"));
}

TEST_F(TileRunnerTest, DrainFinishesWhatIsHeldAndReturns) {
  add_tiles(3);
  start(2);
  ASSERT_TRUE(farm_.wait_for_answers(3));
  runner_->drain();
  join();
  EXPECT_TRUE(farm_.drained);
  EXPECT_EQ(farm_.held, 0);
  EXPECT_TRUE(error_.empty());
}

TEST_F(TileRunnerTest, APilotIsRunAndItsResultCommitted) {
  const SamplingPlan chosen{kEmissionHits, 1, 1};
  source_.renderer->pilot_report = PilotReport{chosen, {{chosen, 1, 2}}, 7, {}};
  source_.renderer->pilot_rounds = 5;
  farm_.add({});
  add_tiles(3);
  start(3);
  ASSERT_TRUE(farm_.wait_for_answers(4));
  const std::vector<std::string>& results = farm_.commits.at({JobId{"j1"}, TileId{0}, 1});
  ASSERT_EQ(results.size(), 1u);
  const PilotResult result = decode_pilot(results.front());
  EXPECT_EQ(pilot_to_json(result.report), pilot_to_json(*source_.renderer->pilot_report));
  EXPECT_GE(result.cpu_seconds, 0);
  EXPECT_EQ(source_.renderer->pilot_threads, 3);
  ASSERT_EQ(farm_.shown.size(), 1u) << "there is something to see before";
  EXPECT_EQ(farm_.shown.front().pixel(1, 0)[1], 7);
}

TEST_F(TileRunnerTest, APilotGoesOnWithoutAFirstLook) {
  source_.renderer->pilot_report = PilotReport();
  source_.renderer->look_fails = true;
  farm_.add({});
  start(1);
  ASSERT_TRUE(farm_.wait_for_answers(1));
  EXPECT_EQ(farm_.commits.size(), 1u);
  EXPECT_TRUE(farm_.shown.empty());
}

TEST_F(TileRunnerTest, NothingIsLeasedBesideAPilotAndALostOneIsCancelled) {
  farm_.add({}, 0.03);
  add_tiles(1, 0.03);
  start(2);
  ASSERT_TRUE(wait_until([&] { return source_.renderer->pilots_begun == 1 && renewals() >= 3; }));
  EXPECT_EQ(answers(), 0u) << "it is renewed while it runs";
  {
    const std::lock_guard lock(farm_.mutex_);
    EXPECT_EQ(farm_.pending.size(), 1u);
    farm_.lose[{JobId{"j1"}, TileId{0}, 1}] = true;
  }
  ASSERT_TRUE(farm_.wait_for_answers(1));
  EXPECT_EQ(source_.renderer->pilots_cancelled, 1);
  EXPECT_EQ(farm_.commits.count({JobId{"j1"}, TileId{1}, 1}), 1u) << "the worker goes on with the tile";
  EXPECT_TRUE(farm_.failures.empty()) << "a lost pilot is nobody's failure";
}

TEST_F(TileRunnerTest, APilotThatThrowsFailsItsLease) {
  source_.renderer->pilot_report = PilotReport();
  source_.renderer->pilot_error = "no light";
  farm_.add({});
  add_tiles(1);
  start(2);
  ASSERT_TRUE(farm_.wait_for_answers(2));
  ASSERT_EQ(farm_.failures.size(), 1u);
  EXPECT_EQ(farm_.failures.begin()->second, "no light");
  EXPECT_EQ(farm_.commits.size(), 1u) << "the worker lives on";
}

TEST_F(TileRunnerTest, DrainAndStopCancelAPilot) {
  for (const bool drain : {true, false}) {
    const int begun = source_.renderer->pilots_begun;
    farm_.cancelled = false;
    farm_.add({});
    start(2);
    ASSERT_TRUE(wait_until([&] { return source_.renderer->pilots_begun == begun + 1; }));
    drain ? runner_->drain() : runner_->stop();
    join();
    EXPECT_EQ(source_.renderer->pilots_cancelled, begun + 1);
    EXPECT_EQ(answers(), 0u);
    EXPECT_EQ(farm_.handed_back.size(), 1u) << "by the drain";
    runner_.reset();
  }
}

TEST_F(TileRunnerTest, ADrainThatTakesTooLongHandsItsTilesBack) {
  add_tiles(1);
  source_.renderer->stuck = true;
  start(2, 0.01);
  const auto count = [&](auto& of) {
    const std::lock_guard lock(farm_.mutex_);
    return of.size();
  };
  ASSERT_TRUE(wait_until([&] {
    const std::lock_guard lock(farm_.mutex_);
    return farm_.held == 1;
  }));
  runner_->drain();
  EXPECT_TRUE(wait_until([&] { return count(farm_.handed_back) == 1; }));
  source_.renderer->stuck = false;
  join();
  EXPECT_EQ(farm_.held, 0);
  EXPECT_EQ(farm_.commits.size() + farm_.failures.size(), 0u);
}

TEST_F(TileRunnerTest, AnIdleWorkerLeavesButNotWhileItRenders) {
  add_tiles(1);
  source_.renderer->stuck = true;
  start(2, 60, 0.05);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // no length of this can make the test fail
  {
    const std::lock_guard lock(farm_.mutex_);
    EXPECT_FALSE(farm_.drained);
  }
  source_.renderer->stuck = false;
  join();
  EXPECT_TRUE(farm_.drained);
  EXPECT_EQ(farm_.commits.size(), 1u);
  EXPECT_TRUE(error_.empty());
}

TEST_F(TileRunnerTest, AWorkerThatFindsNoCoordinatorLeavesAfterItsIdleTimeout) {
  farm_.down_calls = 1 << 30;
  start(1, 60, 0.05);
  join();
  EXPECT_TRUE(farm_.commits.empty());
}

TEST_F(TileRunnerTest, DrainBeforeTheCoordinatorIsReachableReturns) {
  farm_.down_calls = 1 << 30;
  start(1);
  runner_->drain();
  join();
  EXPECT_TRUE(farm_.commits.empty());
}

TEST_F(TileRunnerTest, ATileWhoseSceneHasLostAFileIsHandedBackAndDoesNotFail) {
  source_.lost_file = true;
  add_tiles(2);
  start(1);
  const auto handed_back = [&] {
    const std::lock_guard lock(farm_.mutex_);
    return farm_.missing_blobs;
  };
  ASSERT_TRUE(wait_until([&] { return handed_back() == 2; }));
  EXPECT_EQ(answers(), 0u);
  source_.lost_file = false;
  add_tiles(1);
  ASSERT_TRUE(farm_.wait_for_answers(1));
  EXPECT_EQ(farm_.commits.size(), 1u);
  const std::lock_guard lock(log_mutex_);
  EXPECT_THAT(log_, HasSubstr("handed back: the coordinator has no blob"));
}

TEST_F(TileRunnerTest, HandsInWhatTheCoordinatorHasLost) {
  const testing::TemporaryFolder folder;
  const std::string path = folder.path.string() + "/file";
  std::ofstream(path) << "scene";
  source_.files[sha256_hex("scene")] = path;
  farm_.wanted = {sha256_hex("scene")};
  start(1);
  EXPECT_TRUE(wait_until([&] {
    const std::lock_guard lock(farm_.mutex_);
    return !farm_.handed_in.empty();
  }));
}

}  // namespace
}  // namespace lightmill::agent
