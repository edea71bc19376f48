#include "worker/agent/tile_runner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <thread>

#include "common/error.h"
#include "common/image/film.h"
#include "tests/worker/agent/fake_farm.h"

namespace lightmill::agent {
namespace {

using testing::FakeFarm;
using testing::FixedSource;
using ::testing::HasSubstr;

class TileRunnerTest : public ::testing::Test {
 protected:
  void start(int threads) {
    RunnerOptions options;
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

TEST_F(TileRunnerTest, DrainBeforeTheCoordinatorIsReachableReturns) {
  farm_.down_calls = 1 << 30;
  start(1);
  runner_->drain();
  join();
  EXPECT_TRUE(farm_.commits.empty());
}

}  // namespace
}  // namespace lightmill::agent
