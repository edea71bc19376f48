// The cache of merged layers: its bound, what goes first, and that nothing is lost by going.
#include "coordinator/merge/merger.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include "coordinator/farm/sharing/film_bytes.h"
#include "coordinator/merge/decoder_pool.h"
#include "coordinator/store/memory_job_store.h"
#include "tests/common/film/test_partials.h"
#include "tests/coordinator/core/fake_worker.h"

namespace lightmill {
namespace {

using namespace testing;

class MergerTest : public ::testing::Test {
 protected:
  MergerTest() {
    for (int i = 1; i <= kJobs; ++i) {
      JobRecord job;
      job.id = id(i);
      job.settings = settings;
      store.add_job(job, bundle_to_json(fake_bundle()), {});
      std::vector<TileRecord> tiles;
      for (int64_t t = 0; t < settings.spp; ++t) {
        TileRecord tile;
        tile.id = TileId{t};
        tile.tile = {settings.grid.cells(), t, t + 1};
        tiles.push_back(tile);
      }
      store.add_tiles(job.id, tiles);
    }
  }
  static JobId id(int job) { return JobId{std::string("j").append(std::to_string(job))}; }
  /// Folds and stores the job's next tile.
  void commit(Merger& merger, int job) {
    Merger::Open layers = merger.open(id(job), settings);
    const int64_t next = layers->film.cell_samples(0, 0);
    TileRecord tile = store.tiles(id(job))[static_cast<size_t>(next)];
    tile.state = TileState::kLeased;
    tile.attempt = 1;
    tile.worker = WorkerId{"w1"};
    JobRecord record;
    record.id = id(job);
    record.settings = settings;
    store.save_tile(record, tile);
    tile.state = TileState::kCommitted;
    const Partial partial = fake_partial(tile.tile, settings);
    const std::string bytes = encode_partial(partial);
    layers->film.fold(partial);
    layers->batches.fold(partial);
    ASSERT_TRUE(store.commit_tile(record, tile, bytes));
    layers->spool_bytes += static_cast<double>(bytes.size());
  }
  size_t spooled(int job) {
    size_t count = 0;
    store.for_each_spooled(id(job), [&](const std::string&) { ++count; });
    return count;
  }

  static constexpr int kJobs = 4;
  const RenderSettings settings = small_settings(64, 64, 40);
  const double one = film_bytes(settings);
  MemoryJobStore store;
};

TEST_F(MergerTest, WhatWasNotUsedForLongestGoesFirst) {
  Merger merger(store, 2.5 * one);
  for (const int job : {1, 2, 1, 1, 2, 1}) commit(merger, job);
  EXPECT_EQ(merger.loads(), 2u);
  EXPECT_EQ(merger.bytes(), 2 * one);
  commit(merger, 3);  // the second goes
  EXPECT_EQ(merger.bytes(), 2 * one);
  commit(merger, 1);
  EXPECT_EQ(merger.loads(), 3u);
  commit(merger, 2);
  EXPECT_EQ(merger.loads(), 4u);
  EXPECT_EQ(merger.bytes(), 2 * one);
}

TEST_F(MergerTest, NothingIsLostByEvictionAndAFullSpoolIsCheckpointed) {
  Merger merger(store, 0);  // one at a time
  const int64_t turns = 20;
  bool checkpointed = false;
  for (int64_t turn = 0; turn < turns; ++turn) {
    for (int job = 1; job <= kJobs; ++job) commit(merger, job);
    checkpointed = checkpointed || spooled(1) <= static_cast<size_t>(turn);
  }
  EXPECT_TRUE(checkpointed) << "else every load folds all of it again";
  EXPECT_GT(spooled(1), 0u) << "little is folded again rather than written";
  EXPECT_EQ(merger.loads(), static_cast<uint64_t>(turns * kJobs));
  Film whole(settings.grid);
  whole.fold(fake_partial({settings.grid.cells(), 0, turns}, settings));
  for (int job = 1; job <= kJobs; ++job) {
    EXPECT_TRUE(same_pixels(merger.open(id(job), settings)->film.resolve(), whole.resolve())) << job;
  }
}

TEST_F(MergerTest, LargerThanTheBoundIsServedAloneWhoeverElseWantsIn) {
  Merger merger(store, 0.5 * one);
  std::atomic<int> inside = 0, most = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&, t] {
      for (int turn = 0; turn < 25; ++turn) {
        const Merger::Open layers = merger.open(id(1 + (t + turn) % kJobs), settings);
        most = std::max(most.load(), ++inside);
        std::this_thread::yield();
        --inside;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(most, 1) << "two at once do not fit";
  EXPECT_EQ(merger.bytes(), one);
}

TEST_F(MergerTest, AJobThatWasExtendedTakesMore) {
  Merger merger(store, 10 * one);
  RenderSettings extended = settings;
  extended.spp = 400;
  merger.open(id(1), settings);
  EXPECT_EQ(merger.bytes(), one);
  merger.open(id(1), extended);
  EXPECT_EQ(merger.bytes(), film_bytes(extended));
  EXPECT_GT(film_bytes(extended), one);
  EXPECT_EQ(merger.loads(), 1u);
  Merger::Open layers = merger.open(id(1), extended);
  Merger::reset(layers);
}

TEST(FilmBytes, FollowsTheLayers) {
  const double full = film_bytes(small_settings(64, 64, 16));
  EXPECT_GT(full, film_bytes(small_settings(64, 64, 16, Integrator::kPt)));
  EXPECT_EQ(film_bytes(small_settings(64, 64, 16, Integrator::kPt)),
            film_bytes(small_settings(64, 64, 16, Integrator::kLt)));
  EXPECT_GE(film_bytes(small_settings(64, 64, 16, Integrator::kAuto)), full);
  RenderSettings layered = small_settings(64, 64, 16);
  layered.aovs = kAovAlbedo | kAovDepth;
  constexpr double kLayer = 64 * 64 * 48.0;
  EXPECT_EQ(film_bytes(layered) - full, 2 * kLayer);
  layered.aovs |= kAovLightGroups;
  layered.light_groups = {"key", "fill", "rest"};  // two with layers, each of camera samples and of splats
  EXPECT_EQ(film_bytes(layered) - full, 6 * kLayer);
  layered.aovs |= kAovDifference;  // the half of all, colour and splats included
  EXPECT_EQ(film_bytes(layered) - full, 14 * kLayer);
  layered.aovs |= kAovLobes;  // eight with layers, without halves
  EXPECT_EQ(film_bytes(layered) - full, 30 * kLayer);
  RenderSettings open = small_settings(64, 64, 16, Integrator::kAuto);
  const double undecided = film_bytes(open);
  open.aovs = kAovAlbedo;
  EXPECT_EQ(film_bytes(open) - undecided, 2 * kLayer) << "samples may get weights";
  open.uniform_sampling = true;
  EXPECT_EQ(film_bytes(open) - undecided, kLayer);
}

TEST(DecoderPool, KeepsAsManyAsProcessorsCouldUse) {
  const FilmGrid grid = full_grid(40, 30);
  const Partial partial = random_partial(grid, {{0, 0, 2, 1}, 0, 16}, 1, true, 2);
  const std::string bytes = encode_partial(partial);
  const size_t processors = std::max(1u, std::thread::hardware_concurrency());
  DecoderPool pool(1e9);
  size_t one = 0;
  {
    std::vector<DecoderPool::Loan> loans;
    for (size_t i = 0; i < processors + 2; ++i) {
      loans.push_back(pool.lend(1));
      EXPECT_EQ(loans.back()->decode(bytes, grid, partial.tile), partial);
      one = loans.back()->bytes();
    }
    EXPECT_EQ(pool.bytes(), 0u);
  }
  EXPECT_GT(one, partial.camera.size() * sizeof(ExactRgb));
  EXPECT_EQ(pool.bytes(), processors * one);
  const DecoderPool::Loan again = pool.lend(1);
  EXPECT_EQ(again->bytes(), one) << "one that has its memory";
  EXPECT_EQ(pool.bytes(), (processors - 1) * one);
}

TEST(DecoderPool, LendsAsManyAsFitAndInTurn) {
  DecoderPool pool(100);
  { const DecoderPool::Loan larger_than_all = pool.lend(1000); }
  std::optional<DecoderPool::Loan> first(pool.lend(60));
  { const DecoderPool::Loan beside = pool.lend(40); }
  std::atomic<bool> second_has = false, third_has = false;
  std::jthread second([&] {
    const DecoderPool::Loan loan = pool.lend(60);
    second_has = true;
    second_has.notify_all();
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  std::jthread third([&] {  // would fit, but large ones must get their turn
    const DecoderPool::Loan loan = pool.lend(10);
    third_has = true;
    third_has.notify_all();
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(second_has);
  EXPECT_FALSE(third_has);
  first.reset();
  second_has.wait(false);
  third_has.wait(false);
}

}  // namespace
}  // namespace lightmill
